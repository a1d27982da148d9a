"""A document of SPDX 2.3, and licences of Debian's copyright files in its terms."""

import base64
import datetime
import hashlib
import json
import os
import re
import time
import urllib.parse
import uuid

# Identifiers of SPDX by Debian's short names, in small letters. Others become references.
SPDX_OF_DEBIAN = {
    **{name.lower(): name for name in (
        "Apache-2.0", "Artistic-2.0", "BSD-2-Clause", "BSD-3-Clause", "BSD-4-Clause", "BSL-1.0",
        "CC0-1.0", "FTL", "ISC", "MIT", "MPL-1.1", "MPL-2.0", "NCSA", "OpenSSL", "PostgreSQL",
        "Unlicense", "X11", "Zlib", "curl")},
    "apache-2": "Apache-2.0", "boost-1.0": "BSL-1.0", "expat": "MIT",
    **{f"{family}-{version}{later}".lower(): f"{family}-{spdx}-{'or-later' if later else 'only'}"
       for family, version, spdx in (
           ("GPL", "1", "1.0"), ("GPL", "2", "2.0"), ("GPL", "3", "3.0"), ("GPL", "2.0", "2.0"),
           ("GPL", "3.0", "3.0"), ("LGPL", "2", "2.0"), ("LGPL", "2.0", "2.0"),
           ("LGPL", "2.1", "2.1"), ("LGPL", "3", "3.0"), ("LGPL", "3.0", "3.0"),
           ("AGPL", "3", "3.0"), ("GFDL", "1.2", "1.2"), ("GFDL", "1.3", "1.3"))
       for later in ("", "+")},
}


def identifier(text):
    """Of letters, digits, '.' and '-', as SPDX wants."""
    return re.sub(r"[^A-Za-z0-9.-]", "-", text.replace("+", "plus"))


def purl(locator):
    return {"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl",
            "referenceLocator": locator}


class Document:
    """Packages and how they belong together. Packages are added once, by name and version."""

    def __init__(self, name):
        self._name = name
        self._packages = {}
        self._relationships = []
        self._licences = {}

    def _add(self, kind, name, version, licence, more):
        key = f"SPDXRef-{kind}-{identifier(name)}-{identifier(version)}"
        self._packages.setdefault(key, {
            "SPDXID": key, "name": name, **({"versionInfo": version} if version else {}),
            "downloadLocation": "NOASSERTION", "filesAnalyzed": False,
            "licenseConcluded": "NOASSERTION", "licenseDeclared": licence,
            "copyrightText": "NOASSERTION", **more})
        return key

    def add_root(self, name, version, more):
        key = self._add("Root", name, version, "Apache-2.0", more)
        self.relate("SPDXRef-DOCUMENT", "DESCRIBES", key)
        return key

    def add_named(self, name, licence, version=""):
        """A package of which no more is known."""
        return self._add("Named", name, version, licence, {})

    def add_debian(self, package):
        version = urllib.parse.quote(package.version, safe="")
        name = urllib.parse.quote(package.name, safe="")
        return self._add("Debian", package.name, package.version, self._licence_of(package), {
            "supplier": "Organization: Debian",
            "externalRefs": [purl(f"pkg:deb/debian/{name}@{version}?arch={package.architecture}"
                                  "&distro=debian-12")]})

    def add_npm(self, name, entry):
        algorithm, _, digest = entry.get("integrity", "").partition("-")
        checksums = [{"algorithm": algorithm.upper(),
                      "checksumValue": base64.b64decode(digest).hex()}] if digest else []
        return self._add("npm", name, entry["version"], entry.get("license", "NOASSERTION"), {
            "checksums": checksums,
            "externalRefs": [purl(f"pkg:npm/{name.replace('@', '%40')}@{entry['version']}")]})

    def relate(self, one, kind, other):
        self._relationships.append({"spdxElementId": one, "relationshipType": kind,
                                    "relatedSpdxElement": other})

    def _licence_of(self, package):
        """All licences of a package, as an expression."""
        parsed = package.licence_paragraphs()
        texts = {}
        for fields in parsed:
            title, _, text = fields.get("License", "").partition("\n")
            if text:
                texts.setdefault(title.strip(), text)
        titles = {fields["License"].partition("\n")[0].strip() for fields in parsed
                  if "License" in fields and ("Files" in fields or "Format" in fields)}
        parts = set()
        for title in filter(None, titles):
            part = self._expression(title, package.source, texts)
            is_plain = " OR " not in part and "(" not in part
            parts |= set(part.split(" AND ")) if is_plain else {f"({part})"}
        return " AND ".join(sorted(parts)) or "NOASSERTION"

    def _expression(self, title, source, texts):
        """A licence field's first line. `and` binds as in SPDX; a comma before it binds weaker."""
        clauses = []
        for clause in re.split(r",\s+(and|or)\s+", title):
            words = re.split(r"\s+(and|or)\s+", clause)
            clauses.append(" ".join(word.upper() if word in ("and", "or")
                                    else self._named(word, source, texts) for word in words))
        if len(clauses) == 1:
            return clauses[0]
        return " ".join(f"({clause})" if " " in clause else clause for clause in clauses)

    def _named(self, name, source, texts):
        name = name.strip()
        if name.lower() in SPDX_OF_DEBIAN:
            return SPDX_OF_DEBIAN[name.lower()]
        reference = f"LicenseRef-{identifier(source)}-{identifier(name)}"
        text = texts.get(name, f"See debian/copyright of the source package {source}.")
        self._licences.setdefault(reference, {"licenseId": reference, "name": name,
                                              "extractedText": text})
        return reference

    def text(self):
        content = {
            "packages": [self._packages[key] for key in sorted(self._packages)],
            "hasExtractedLicensingInfos": [self._licences[key] for key in sorted(self._licences)],
            "relationships": self._relationships,
        }
        digest = hashlib.sha256(json.dumps([self._name, content]).encode()).hexdigest()
        seconds = int(os.environ.get("SOURCE_DATE_EPOCH", time.time()))
        created = datetime.datetime.fromtimestamp(seconds, datetime.timezone.utc)
        return json.dumps({
            "spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT",
            "name": self._name,
            "documentNamespace": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_OID, digest)}",
            "creationInfo": {"created": created.strftime("%Y-%m-%dT%H:%M:%SZ"),
                             "creators": ["Tool: liquidblend-sbom"]},
            **content}, indent=1) + "\n"
