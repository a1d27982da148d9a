// Archives of files as Blobs of headers and slices: no file is read into memory.
import { tarEnd, tarHeader, tarPadding } from '../base/tar.ts';

export interface TarEntry {
  name: string;
  file: Blob;
}

export function tarOf(entries: TarEntry[]): Blob {
  const parts = entries.flatMap(({ name, file }) => [
    tarHeader(name, file.size),
    file,
    tarPadding(file.size),
  ]);
  return new Blob([...parts, tarEnd()], { type: 'application/x-tar' });
}
