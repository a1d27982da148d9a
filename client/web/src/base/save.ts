// Gives files to the person: to disk piece by piece where the browser can, else at the end.

/** Where the bytes of a file go, one piece after the other. */
export interface FileSink {
  write(bytes: Uint8Array<ArrayBuffer>): Promise<void>;
  close(): Promise<void>;
  /** Leaves no file. */
  abort(): Promise<void>;
}

interface WritableFile {
  write(bytes: Uint8Array<ArrayBuffer>): Promise<void>;
  close(): Promise<void>;
  abort(): Promise<void>;
}

type SavePicker = (options: { suggestedName: string }) => Promise<{
  createWritable(): Promise<WritableFile>;
}>;

const pieceBytes = 8 << 20;

export function saveBlob(blob: Blob, name: string): void {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

/** Requires: called by a click. Errors: AbortError if the person chose no file. */
export async function openSink(name: string): Promise<FileSink> {
  const { showSaveFilePicker } = window as { showSaveFilePicker?: SavePicker };
  if (!showSaveFilePicker) return new BlobSink(name);
  const handle = await showSaveFilePicker({ suggestedName: name });
  return handle.createWritable();
}

// Browsers keep large Blobs on disk, so pieces become Blobs early.
class BlobSink implements FileSink {
  private readonly blobs: Blob[] = [];
  private pieces: Uint8Array<ArrayBuffer>[] = [];
  private numBytes = 0;

  constructor(private readonly name: string) {}

  async write(bytes: Uint8Array<ArrayBuffer>): Promise<void> {
    this.pieces.push(bytes);
    this.numBytes += bytes.length;
    if (this.numBytes >= pieceBytes) this.gather();
  }

  async close(): Promise<void> {
    this.gather();
    saveBlob(new Blob(this.blobs, { type: 'application/x-tar' }), this.name);
  }

  async abort(): Promise<void> {
    this.pieces = [];
    this.blobs.length = 0;
  }

  private gather(): void {
    this.blobs.push(new Blob(this.pieces));
    this.pieces = [];
    this.numBytes = 0;
  }
}
