// Bundles three.js and uPlot into src/page/vendor: minified, compressed, with licences and hashes.

import { createHash } from 'node:crypto';
import { copyFileSync, readFileSync, writeFileSync } from 'node:fs';
import { brotliCompressSync, constants } from 'node:zlib';
import { build } from 'esbuild';

const here = (path) => new URL(path, import.meta.url).pathname;
const vendor = (name) => here(`../../src/page/vendor/${name}`);
const version = (name) => JSON.parse(readFileSync(here(`node_modules/${name}/package.json`), 'utf8')).version;

const sums = [];

/** Writes the file and its brotli form, and records the hashes of both. */
function keep(name, bytes) {
  const compressed = brotliCompressSync(bytes, {
    params: { [constants.BROTLI_PARAM_QUALITY]: 11, [constants.BROTLI_PARAM_LGWIN]: 24, [constants.BROTLI_PARAM_SIZE_HINT]: bytes.length },
  });
  for (const [file, content] of [[name, bytes], [`${name}.br`, compressed]]) {
    writeFileSync(vendor(file), content);
    sums.push(`${createHash('sha256').update(content).digest('hex')}  ${file}\n`);
    console.log(`${file}: ${content.length} bytes`);
  }
}

for (const [library, entry] of [['three', 'three.entry.js'], ['uplot', 'uplot.entry.js']]) {
  const { outputFiles } = await build({
    entryPoints: [here(entry)],
    bundle: true,
    minify: true,
    format: 'esm',
    target: 'es2022',
    legalComments: 'none',
    banner: { js: `/* ${library} ${version(library)}, MIT: ${library}.LICENSE */` },
    write: false,
  });
  keep(`${library}.js`, Buffer.from(outputFiles[0].contents));
  copyFileSync(here(`node_modules/${library}/LICENSE`), vendor(`${library}.LICENSE`));
}
keep('uplot.css', readFileSync(here('node_modules/uplot/dist/uPlot.min.css')));
writeFileSync(vendor('SHA256SUMS'), sums.join(''));
