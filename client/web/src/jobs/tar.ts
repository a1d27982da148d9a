// Tar archives (ustar) as Blobs of headers and slices of files: no file is read into memory.

export interface TarEntry {
  name: string;
  file: Blob;
  modifiedMs?: number;
}

const block = 512;
const encoder = new TextEncoder();
const maxName = 100;  // bytes
const maxOctalSize = 8 ** 11;

function writeText(header: Uint8Array, at: number, text: string): void {
  header.set(encoder.encode(text), at);
}

function octal(value: number, digits: number): string {
  return Math.floor(value).toString(8).padStart(digits, '0') + '\0';
}

// Sizes of 8 GiB and more as GNU tar writes them: big-endian, the first bit set.
function writeSize(header: Uint8Array, size: number): void {
  if (size < maxOctalSize) return writeText(header, 124, octal(size, 11));
  let rest = size;
  for (let at = 135; at > 124; --at) {
    header[at] = rest % 256;
    rest = Math.floor(rest / 256);
  }
  header[124] = 0x80;
}

function writeChecksum(header: Uint8Array): void {
  header.fill(0x20, 148, 156);
  const total = header.reduce((sum, byte) => sum + byte, 0);
  writeText(header, 148, octal(total, 6) + ' ');
}

function headerOf(name: Uint8Array, size: number, type: string, modifiedMs: number) {
  const header = new Uint8Array(block);
  header.set(name.subarray(0, maxName), 0);
  writeText(header, 100, octal(0o644, 7));
  writeText(header, 108, octal(0, 7));
  writeText(header, 116, octal(0, 7));
  writeSize(header, size);
  writeText(header, 136, octal(Math.max(0, modifiedMs / 1000), 11));
  writeText(header, 156, type);
  writeText(header, 257, 'ustar\0' + '00');
  writeChecksum(header);
  return header;
}

function padding(size: number): Uint8Array<ArrayBuffer> {
  return new Uint8Array((block - (size % block)) % block);
}

// A pax record counts its own length.
function paxRecord(key: string, value: string): Uint8Array<ArrayBuffer> {
  const rest = encoder.encode(` ${key}=${value}\n`).length;
  let length = rest + 1;
  while (String(length).length + rest !== length) length = String(length).length + rest;
  return encoder.encode(`${length} ${key}=${value}\n`) as Uint8Array<ArrayBuffer>;
}

function longName(name: string, modifiedMs: number): BlobPart[] {
  const record = paxRecord('path', name);
  const header = headerOf(encoder.encode('long_name'), record.length, 'x', modifiedMs);
  return [header, record, padding(record.length)];
}

function partsOf({ name, file, modifiedMs = 0 }: TarEntry): BlobPart[] {
  const bytes = encoder.encode(name);
  const before = bytes.length > maxName ? longName(name, modifiedMs) : [];
  return [...before, headerOf(bytes, file.size, '0', modifiedMs), file, padding(file.size)];
}

export function tarOf(entries: TarEntry[]): Blob {
  return new Blob([...entries.flatMap(partsOf), new Uint8Array(2 * block)], {
    type: 'application/x-tar',
  });
}
