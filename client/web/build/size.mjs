// Prints what a first visit transfers, compressed, and refuses more than the budget.
import { readdirSync, readFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { gzipSync } from 'node:zlib';

const root = dirname(dirname(fileURLToPath(import.meta.url)));
const dist = process.env.LIQUIDBLEND_PAGE ?? join(root, 'dist');
const budget = 400_000;

let total = 0;
for (const name of ['index.html', ...readdirSync(join(dist, 'page')).map((n) => `page/${n}`)]) {
  const size = gzipSync(readFileSync(join(dist, name)), { level: 9 }).length;
  total += size;
  console.log(`${String(size).padStart(8)}  ${name}`);
}
console.log(`${String(total).padStart(8)}  bytes compressed, of ${budget}`);
if (total > budget) process.exitCode = 1;
