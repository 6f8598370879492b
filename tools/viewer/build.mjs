// Makes lib/src/report/viewer.html of page.html, style.css and src. With --check it only says whether that file is what
// would be made.
import * as esbuild from 'esbuild';
import {createHash} from 'node:crypto';
import {readFileSync, writeFileSync} from 'node:fs';

const here = new URL('.', import.meta.url);
const target = new URL('../../lib/src/report/viewer.html', here);
const read = (name) => readFileSync(new URL(name, here), 'utf8');
const hash = (text) => createHash('sha256').update(text, 'utf8').digest('base64');

const options = {minify: true, write: false, charset: 'ascii', legalComments: 'none'};
const bundled = await esbuild.build({
  ...options, entryPoints: [new URL('src/main.js', here).pathname], bundle: true, format: 'iife', target: 'es2020',
});
const notice = `/*!\nThis page holds three.js:\n${read('node_modules/three/LICENSE').trim().replace(/\*\//g, '')}\n*/\n`;
const script = notice + bundled.outputFiles[0].text.trim();
const style = (await esbuild.transform(read('style.css'), {minify: true, loader: 'css'})).code.trim();
for (const text of [script, style])
  if (/<\/(script|style)|<!--|\{\{(title|data)\}\}/i.test(text)) throw new Error('what is built would end its element');

const parts = {script, style, script_hash: hash(script), style_hash: hash(style)};
const page = read('page.html').replace(/\{\{(script|style|script_hash|style_hash)\}\}/g, (_, name) => parts[name]);
if (process.argv.includes('--check')) {
  const same = readFileSync(target, 'utf8') === page;
  console.log(same ? 'viewer.html is up to date' : 'viewer.html differs from what src makes: npm run build');
  process.exit(same ? 0 : 1);
}
writeFileSync(target, page);
console.log(`viewer.html: ${Math.round(page.length / 1024)} KiB`);
