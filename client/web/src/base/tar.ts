// Writes tar archives (ustar) of small-named files, piece by piece.
const blockSize = 512;
const maxName = 100;
const maxSize = 8 ** 11 - 1;

/** The header before a file's bytes. Requires: a name of at most 100 bytes, less than 8 GiB. */
export function tarHeader(name: string, size: number): Uint8Array<ArrayBuffer> {
  const bytes = new TextEncoder().encode(name);
  if (bytes.length > maxName || size > maxSize) throw new RangeError(`No tar can hold ${name}.`);
  const header = new Uint8Array(blockSize);
  header.set(bytes, 0);
  const put = (text: string, at: number) => header.set(new TextEncoder().encode(text), at);
  put('0000644\0', 100);
  put('0000000\0', 108);
  put('0000000\0', 116);
  put(`${octal(size, 11)}\0`, 124);
  put(`${octal(0, 11)}\0`, 136);
  put(' '.repeat(8), 148);
  put('0', 156);
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

/** The number of bytes of an archive of files of these sizes. */
export function tarSize(sizes: readonly number[]): number {
  const blocks = sizes.reduce((total, size) => total + 1 + Math.ceil(size / blockSize), 2);
  return blocks * blockSize;
}

function octal(value: number, digits: number): string {
  return value.toString(8).padStart(digits, '0');
}
