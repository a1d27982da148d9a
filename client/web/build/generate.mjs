// Generates TypeScript from proto/ and Google's definitions into src/generated, which git ignores.
import { execFileSync } from 'node:child_process';
import { existsSync, mkdirSync, readFileSync, rmSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const root = dirname(dirname(fileURLToPath(import.meta.url)));
const out = join(root, 'src/generated');
const plugin = join(root, 'node_modules/.bin/protoc-gen-es');
const folders = [join(root, '../../proto'), join(root, 'node_modules/google-proto-files')];
const wanted = ['liquidblend/v1/liquidblend.proto', 'google/rpc/error_details.proto'];

// A file and all that it imports; google/protobuf is in @bufbuild/protobuf.
function withImports(file, seen) {
  if (seen.has(file) || file.startsWith('google/protobuf/')) return;
  seen.add(file);
  const folder = folders.find((candidate) => existsSync(join(candidate, file)));
  if (!folder) throw new Error(`generate: ${file} is in none of ${folders.join(', ')}`);
  const text = readFileSync(join(folder, file), 'utf8');
  for (const [, imported] of text.matchAll(/^import (?:public )?"([^"]+)";/gm)) {
    withImports(imported, seen);
  }
}

function run() {
  const files = new Set();
  for (const file of wanted) withImports(file, files);
  rmSync(out, { recursive: true, force: true });
  mkdirSync(out, { recursive: true });
  const includes = folders.map((folder) => `-I${folder}`);
  execFileSync(
    process.env.PROTOC ?? 'protoc',
    [...includes, `--plugin=${plugin}`, `--es_out=${out}`, '--es_opt=target=ts', ...files],
    { stdio: 'inherit' },
  );
}

run();
