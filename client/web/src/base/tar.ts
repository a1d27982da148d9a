// Writes tar archives (ustar, long names as in pax) piece by piece.
const blockSize = 512;
const maxName = 100;
const maxOctalSize = 8 ** 11 - 1;
const encoder = new TextEncoder();

/** The header before a file's bytes. */
export function tarHeader(name: string, size: number): Uint8Array<ArrayBuffer> {
  const bytes = encoder.encode(name);
  const header = headerOf(bytes.subarray(0, maxName), size, '0');
  return bytes.length > maxName ? joined([longName(name), header]) : header;
}

// An entry of its own, whose bytes are the name of the next one.
function longName(name: string): Uint8Array<ArrayBuffer> {
  const record = paxRecord('path', name);
  const header = headerOf(encoder.encode('long_name'), record.length, 'x');
  return joined([header, record, tarPadding(record.length)]);
}

// A pax record begins with its own length.
function paxRecord(key: string, value: string): Uint8Array<ArrayBuffer> {
  const text = ` ${key}=${value}\n`;
  const rest = encoder.encode(text).length;
  let length = rest + 1;
  while (String(length).length + rest !== length) length = String(length).length + rest;
  return joined([encoder.encode(`${length}${text}`)]);
}

function joined(parts: Uint8Array[]): Uint8Array<ArrayBuffer> {
  const all = new Uint8Array(parts.reduce((total, part) => total + part.length, 0));
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
}

// Sizes of 8 GiB and more as GNU tar writes them: big-endian, the first bit set.
function sizeField(size: number): Uint8Array {
  if (size <= maxOctalSize) return encoder.encode(`${octal(size, 11)}\0`);
  const field = new Uint8Array(12);
  let rest = size;
  for (let at = 11; at > 0; --at) {
    field[at] = rest % 256;
    rest = Math.floor(rest / 256);
  }
  field[0] = 0x80;
  return field;
}

function headerOf(name: Uint8Array, size: number, type: string): Uint8Array<ArrayBuffer> {
  const header = new Uint8Array(blockSize);
  header.set(name, 0);
  const put = (text: string, at: number) => header.set(encoder.encode(text), at);
  put('0000644\0', 100);
  put('0000000\0', 108);
  put('0000000\0', 116);
  header.set(sizeField(size), 124);
  put(`${octal(0, 11)}\0`, 136);
  put(' '.repeat(8), 148);
  put(type, 156);
  put('ustar\0', 257);
  put('00', 263);
  const checksum = header.reduce((total, byte) => total + byte, 0);
  put(`${octal(checksum, 6)}\0 `, 148);
  return header;
}

/** What follows a file's bytes up to the next header. */
export function tarPadding(size: number): Uint8Array<ArrayBuffer> {
  return new Uint8Array((blockSize - (size % blockSize)) % blockSize);
}

export function tarEnd(): Uint8Array<ArrayBuffer> {
  return new Uint8Array(2 * blockSize);
}

/** The number of bytes of an archive of files of these sizes, with names of at most 100 bytes. */
export function tarSize(sizes: readonly number[]): number {
  const blocks = sizes.reduce((total, size) => total + 1 + Math.ceil(size / blockSize), 2);
  return blocks * blockSize;
}

function octal(value: number, digits: number): string {
  return value.toString(8).padStart(digits, '0');
}
