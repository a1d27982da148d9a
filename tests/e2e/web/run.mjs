// Runs the browser tests one after the other, those of some files or all:
//   BASE_URL=http://127.0.0.1:8080 [TOKEN=..] node run.mjs [play scrub ..]
// The server needs a registered family two_drops of drops_a and drops_b.
import { readdirSync } from 'node:fs';
import { run } from 'node:test';
import { tap } from 'node:test/reporters';
import { fileURLToPath } from 'node:url';

if (!process.env.BASE_URL) {
  console.error('run.mjs: BASE_URL must be the address of a server with the page');
  process.exit(2);
}
const wanted = process.argv.slice(2);
const files = readdirSync(new URL('.', import.meta.url))
  .filter((name) => name.endsWith('.test.mjs'))
  .filter((name) => !wanted.length || wanted.includes(name.replace('.test.mjs', '')))
  .map((name) => fileURLToPath(new URL(name, import.meta.url)));
if (!files.length) {
  console.error(`run.mjs: there is no test called ${wanted.join(', ')}`);
  process.exit(2);
}
run({ files, concurrency: 1 })
  .on('test:fail', () => {
    process.exitCode = 1;
  })
  .compose(tap)
  .pipe(process.stdout);
