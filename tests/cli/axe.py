"""Runs axe-core on a page in a browser: `npm ci` in tools/viewer installs it; without it these tests are skipped."""
import pathlib

SCRIPT = pathlib.Path(__file__).resolve().parents[2] / "tools" / "viewer" / "node_modules" / "axe-core" / "axe.min.js"
MISSING = None if SCRIPT.exists() else "SKIPPED: axe-core is not there: npm ci in tools/viewer"


def serious_faults(driver):
    """The violations that axe-core rates as serious or critical: rule and elements."""
    driver.execute_script(SCRIPT.read_text())
    return driver.execute_async_script("""
        const done = arguments[arguments.length - 1];
        axe.run().then(({violations}) => done(violations.filter(({impact}) => ['serious', 'critical'].includes(impact)).map(({id, nodes}) => [id, nodes.map((n) => n.html.slice(0, 120))])));""")
