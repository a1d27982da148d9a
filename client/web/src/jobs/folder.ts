// Files of a folder that a person dropped or chose.

export interface Folder {
  name: string;  // empty if files were given without one
  files: File[];
  numSkipped: number;  // that are no frames, or lie in folders below
}

const frameNames = [
  /\.bobj\.gz$/i,
  /^lVelMesh_.*\.uni$/i,
  /\.ply$/i,
  /\.obj$/i,
  /\.stl$/i,
  /\.vdb$/i,
];

export function isOfAnimation(name: string): boolean {
  return name === 'meta.json' || frameNames.some((pattern) => pattern.test(name));
}

function byName(a: File, b: File): number {
  return a.name < b.name ? -1 : a.name > b.name ? 1 : 0;
}

function numberOf(name: string): string {
  return /(\d+)\.(?:bobj\.gz|uni)$/i.exec(name)?.[1] ?? '';
}

// Mantaflow leaves velocities of frames that have no mesh; the import would refuse them.
function withoutStrayVelocities(files: File[]): File[] {
  const isVelocity = (file: File) => file.name.endsWith('.uni');
  const meshes = new Set(
    files.filter((file) => !isVelocity(file)).map((file) => numberOf(file.name)),
  );
  return files.filter((file) => !isVelocity(file) || meshes.has(numberOf(file.name)));
}

function folderOf(name: string, all: File[], numBelow: number): Folder {
  const known = all.filter((file) => isOfAnimation(file.name)).sort(byName);
  const files = withoutStrayVelocities(known);
  return { name, files, numSkipped: all.length - files.length + numBelow };
}

/** Of an input with `webkitdirectory`: paths begin with the folder's name. */
export function folderOfInput(list: Iterable<File>): Folder {
  const all = [...list];
  const parts = (file: File) => (file.webkitRelativePath || file.name).split('/');
  const own = all.filter((file) => parts(file).length <= 2);
  const path = all.map(parts).find((found) => found.length > 1);
  return folderOf(path?.[0] ?? '', own, all.length - own.length);
}

function readEntries(reader: FileSystemDirectoryReader): Promise<FileSystemEntry[]> {
  return new Promise((resolve, reject) => reader.readEntries(resolve, reject));
}

// Browsers give at most 100 entries at a time.
async function allEntries(directory: FileSystemDirectoryEntry): Promise<FileSystemEntry[]> {
  const reader = directory.createReader();
  const all: FileSystemEntry[] = [];
  for (;;) {
    const entries = await readEntries(reader);
    if (!entries.length) return all;
    all.push(...entries);
  }
}

function fileOf(entry: FileSystemEntry): Promise<File> {
  return new Promise((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject));
}

async function folderOfDirectory(directory: FileSystemDirectoryEntry): Promise<Folder> {
  const entries = await allEntries(directory);
  const files = await Promise.all(entries.filter((entry) => entry.isFile).map(fileOf));
  return folderOf(directory.name, files, entries.length - files.length);
}

/** Of a drop: one folder, or files. Must be called while the event is handled. */
export async function folderOfDrop(data: DataTransfer): Promise<Folder> {
  const entries = [...data.items].map((item) => item.webkitGetAsEntry?.() ?? null);
  const files = [...data.files];
  const directories = entries.filter((entry) => entry?.isDirectory);
  if (directories.length > 1)
    throw new Error('Drop one folder at a time: a folder is an animation.');
  if (directories.length) return folderOfDirectory(directories[0] as FileSystemDirectoryEntry);
  return folderOf('', files, 0);
}
