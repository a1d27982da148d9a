// Checks of Kubernetes objects without a cluster: values against the schemas, fields against the
// types, of Kubernetes' API and of KEDA's.
import ts from 'typescript';
import { fileURLToPath } from 'node:url';
import { nameOf } from './manifests.mjs';

function moduleOf(object) {
  const group = object.apiVersion.startsWith('keda.sh/') ? '@kubernetes-models/keda' :
    'kubernetes-models';
  return `${group}/${object.apiVersion}`;
}

// What is wrong with the values: a missing field, a wrong type, a value out of range.
export async function schemaErrors(objects) {
  const errors = [];
  for (const object of objects) {
    const { [object.kind]: Model } = await import(moduleOf(object)).catch(() => ({}));
    if (!Model) {
      errors.push(`${nameOf(object)}: ${object.apiVersion} has no such kind`);
      continue;
    }
    try {
      new Model(object).validate();
    } catch (error) {
      errors.push(`${nameOf(object)}: ${error.message}`);
    }
  }
  return errors;
}

// Fields that the API does not have: each object becomes a literal of its type, in which
// TypeScript finds what does not belong.
export function unknownFields(objects) {
  const file = fileURLToPath(new URL('objects.ts', import.meta.url));
  const text = objects.map((object, k) =>
    `import type {I${object.kind} as T${k}} from '${moduleOf(object)}';\n` +
    `export const object${k}: T${k} = ${JSON.stringify(object)};\n`).join('');
  const options = { noEmit: true, strict: true, skipLibCheck: true, target: ts.ScriptTarget.ES2022,
    module: ts.ModuleKind.NodeNext, moduleResolution: ts.ModuleResolutionKind.NodeNext };
  const host = ts.createCompilerHost(options);
  const { getSourceFile, fileExists } = host;
  host.fileExists = (path) => path === file || fileExists(path);
  host.getSourceFile = (path, ...more) =>
    path === file ? ts.createSourceFile(path, text, ...more) : getSourceFile(path, ...more);
  const program = ts.createProgram([file], options, host);
  return ts.getPreEmitDiagnostics(program)
    .map((found) => ts.flattenDiagnosticMessageText(found.messageText, '\n'));
}
