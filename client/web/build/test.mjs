// Compiles test/*.test.ts by esbuild, which Vite brings, and runs them by node:test.
import { spawnSync } from 'node:child_process';
import { mkdtempSync, readdirSync, rmSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { build } from 'esbuild';

const root = dirname(dirname(fileURLToPath(import.meta.url)));
const tests = readdirSync(join(root, 'test')).filter((file) => file.endsWith('.test.ts'));
const out = mkdtempSync(join(root, 'node_modules/.test-'));

try {
  await build({
    entryPoints: tests.map((file) => join(root, 'test', file)),
    outdir: out,
    outExtension: { '.js': '.mjs' },
    bundle: true,
    format: 'esm',
    platform: 'node',
    packages: 'external',
    tsconfig: join(root, 'tsconfig.json'),
    logLevel: 'warning',
  });
  const files = tests.map((file) => join(out, file.replace(/\.ts$/, '.mjs')));
  process.exitCode = spawnSync(process.execPath, ['--test', ...files], { stdio: 'inherit' }).status;
} finally {
  rmSync(out, { recursive: true, force: true });
}
