#!/usr/bin/env python3
"""Makes a C++ source of the files of the page, compressed, for server/http/page.h.

  pack_page.py FOLDER OUTPUT FUNCTION

FOLDER has index.html and what it loads, below page/; without it, the page is empty.
The output is the same for the same files.
"""
import gzip
import hashlib
import pathlib
import sys

TYPES = {
    ".css": "text/css; charset=utf-8",
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".png": "image/png",
    ".svg": "image/svg+xml",
    ".txt": "text/plain; charset=utf-8",
    ".wasm": "application/wasm",
    ".woff2": "font/woff2",
}


def literal(content):
    """Bytes as an array's initialiser."""
    lines = [content[k:k + 24] for k in range(0, len(content), 24)]
    return ",\n    ".join(",".join(str(byte) for byte in line) for line in lines)


def main():
    folder, output, function = pathlib.Path(sys.argv[1]), sys.argv[2], sys.argv[3]
    index = folder / "index.html"
    files = []
    if index.is_file():
        below = sorted(path for path in (folder / "page").rglob("*") if path.is_file())
        files = [("/", index)] + [("/" + path.relative_to(folder).as_posix(), path)
                                  for path in below]
    arrays, rows = [], []
    for number, (path, file) in enumerate(files):
        content = file.read_bytes()
        packed = gzip.compress(content, 9, mtime=0)
        arrays.append(f"const unsigned char kFile{number}[] = {{\n    {literal(packed)}}};\n")
        kind = TYPES.get(file.suffix, "application/octet-stream")
        tag = hashlib.sha256(content).hexdigest()[:16]
        rows.append(f'    {{"{path}", "{kind}", BytesOf(kFile{number}), "\\"{tag}\\""}},\n')
    size = max(1, len(rows))
    with open(output, "w", encoding="utf-8") as out:
        out.write('#include "server/http/answers/page.h"\n\nnamespace liquidblend::http {\n')
        out.write("namespace {\n\n")
        out.write("template <size_t kSize>\n")
        out.write("[[maybe_unused]] std::string_view BytesOf(const unsigned char (&bytes)[kSize]) {\n")
        out.write("  return {reinterpret_cast<const char*>(bytes), kSize};\n}\n\n")
        out.write("".join(arrays))
        out.write(f"\n}}  // namespace\n\nPageFiles {function}() {{\n")
        out.write(f"  static const PageFile files[{size}] = {{\n{''.join(rows)}  }};\n")
        out.write(f"  return PageFiles(files, {len(rows)});\n}}\n\n")
        out.write("}  // namespace liquidblend::http\n")


if __name__ == "__main__":
    main()
