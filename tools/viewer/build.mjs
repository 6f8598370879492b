// Builds two pages, each as one file: viewer.html (written by covol report) from page.html, and mark.html (served by covol
// mark) from mark_page.html. --out FOLDER writes them to another folder; --check only checks whether they are up to date.
import * as esbuild from 'esbuild';
import {createHash} from 'node:crypto';
import {mkdirSync, readFileSync, writeFileSync} from 'node:fs';
import {basename, join} from 'node:path';
import {fileURLToPath} from 'node:url';

const here = new URL('.', import.meta.url);
const PAGES = [
  {page: 'page.html', entry: 'src/report/main.js', styles: ['base.css', 'viewer.css', 'report.css'], target: '../../lib/src/report/viewer.html'},
  {page: 'mark_page.html', entry: 'src/mark/main.js', styles: ['base.css', 'viewer.css', 'mark.css'], target: '../covol/mark/mark.html'},
];
const read = (name) => readFileSync(new URL(name, here), 'utf8');
const hash = (text) => createHash('sha256').update(text, 'utf8').digest('base64');
const isCheck = process.argv.includes('--check'), out = process.argv.includes('--out') ? process.argv[process.argv.indexOf('--out') + 1] : null;

async function build({page, entry, styles}) {
  const options = {minify: true, write: false, charset: 'ascii', legalComments: 'none'};
  const bundled = await esbuild.build({
    ...options, entryPoints: [fileURLToPath(new URL(entry, here))], bundle: true, format: 'iife', target: 'es2020',
  });
  const notice = `/*!\nThis page holds three.js:\n${read('node_modules/three/LICENSE').trim().replace(/\*\//g, '')}\n*/\n`;
  const script = notice + bundled.outputFiles[0].text.trim();
  const style = (await esbuild.transform(styles.map(read).join('\n'), {minify: true, loader: 'css'})).code.trim();
  for (const text of [script, style])
    if (/<\/(script|style)|<!--|\{\{(title|data)\}\}/i.test(text)) throw new Error('what is built would end its element');
  const parts = {script, style, script_hash: hash(script), style_hash: hash(style)};
  return read(page).replace(/\{\{(script|style|script_hash|style_hash)\}\}/g, (_, name) => parts[name]);
}

let isSame = true;
for (const page of PAGES) {
  const text = await build(page), name = basename(page.target);
  const target = out ? join(out, name) : fileURLToPath(new URL(page.target, here));
  if (isCheck) {
    const same = readFileSync(target, 'utf8') === text;
    console.log(same ? `${name} is up to date` : `${name} differs from what src makes: npm run build`);
    isSame &&= same;
  } else {
    if (out) mkdirSync(out, {recursive: true});
    writeFileSync(target, text);
    console.log(`${name}: ${Math.round(text.length / 1024)} KiB`);
  }
}
process.exit(isSame ? 0 : 1);
