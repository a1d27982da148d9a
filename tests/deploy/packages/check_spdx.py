#!/usr/bin/env python3
"""Whether lists of contents are SPDX 2.3 in JSON: required fields, references, licences.

  check_spdx.py FILE..

Exit: 0 all are; 1 not, with a line for each fault; 2 usage.
"""

import json
import pathlib
import re
import sys

# Required by the published schema of 2.3, and what 2.3 requires in its text beyond that.
REQUIRED = {
    "document": ("spdxVersion", "dataLicense", "SPDXID", "name", "documentNamespace", "creationInfo",
                 "packages", "relationships"),
    "creationInfo": ("created", "creators"),
    "packages": ("SPDXID", "name", "downloadLocation"),
    "relationships": ("spdxElementId", "relatedSpdxElement", "relationshipType"),
    "hasExtractedLicensingInfos": ("licenseId", "extractedText"),
}
KINDS = {"DESCRIBES", "CONTAINS", "DEPENDS_ON", "STATIC_LINK"}
DOCUMENT = "SPDXRef-DOCUMENT"


def missing(kind, value):
    for field in REQUIRED[kind]:
        if not value.get(field):
            yield f"{kind}: no {field} in {str(value)[:80]}"


def form_faults(document):
    if (document.get("spdxVersion"), document.get("dataLicense")) != ("SPDX-2.3", "CC0-1.0"):
        yield "neither SPDX-2.3 nor CC0-1.0"
    if not re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ",
                        document.get("creationInfo", {}).get("created", "")):
        yield "creationInfo: created is not a time"
    for package in document.get("packages", []):
        if not re.fullmatch(r"SPDXRef-[A-Za-z0-9.-]+", package.get("SPDXID", "")):
            yield f"{package.get('SPDXID')} is not an identifier"


def reference_faults(document):
    ids = [package.get("SPDXID") for package in document.get("packages", [])]
    if len(set(ids)) != len(ids):
        yield "two packages have one identifier"
    related = set()
    for relationship in document.get("relationships", []):
        if relationship.get("relationshipType") not in KINDS:
            yield f"unknown relationship: {relationship}"
        ends = relationship.get("spdxElementId"), relationship.get("relatedSpdxElement")
        related.update(ends)
        yield from (f"{end} is not there" for end in ends if end not in [DOCUMENT, *ids])
    yield from (f"{name} is related to nothing" for name in [DOCUMENT, *ids] if name not in related)


def licence_faults(document):
    known = {entry.get("licenseId") for entry in document.get("hasExtractedLicensingInfos", [])}
    for package in document.get("packages", []):
        for name in re.findall(r"LicenseRef-[\w.-]+", package.get("licenseDeclared", "")):
            if name not in known:
                yield f"{package.get('name')}: {name} has no text"


def faults(document):
    yield from missing("document", document)
    yield from missing("creationInfo", document.get("creationInfo", {}))
    for kind in ("packages", "relationships", "hasExtractedLicensingInfos"):
        for value in document.get(kind, []):
            yield from missing(kind, value)
    yield from form_faults(document)
    yield from reference_faults(document)
    yield from licence_faults(document)


def main(files):
    if not files or files[0].startswith("-"):
        print(__doc__, file=sys.stderr)
        return 0 if files == ["--help"] else 2
    found = [f"{file}: {fault}" for file in files
             for fault in faults(json.loads(pathlib.Path(file).read_text()))]
    print("\n".join(found), end="\n" if found else "")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
