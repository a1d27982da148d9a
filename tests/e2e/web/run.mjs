// Runs the browser tests one after the other, those of one file or all:
//   BASE_URL=http://127.0.0.1:8080 [TOKEN=..] node run.mjs [play scrub ..]
// The server needs a registered family two_drops of drops_a and drops_b.
import { readdirSync } from 'node:fs';

if (!process.env.BASE_URL) {
  console.error('run.mjs: BASE_URL must be the address of a server with the page');
  process.exit(2);
}
const wanted = process.argv.slice(2);
const folder = new URL('.', import.meta.url);
const files = readdirSync(folder).filter((name) => name.endsWith('.test.mjs'));
for (const file of files.sort()) {
  if (!wanted.length || wanted.includes(file.replace('.test.mjs', ''))) {
    await import(new URL(file, folder));
  }
}
