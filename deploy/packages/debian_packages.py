"""Debian packages of a machine or an image: versions, sources, licences, and who has a header."""

import pathlib
import re
import subprocess

TOOLCHAIN = {"gcc-12", "glibc", "linux"}  # their headers are in each program


def paragraphs(text):
    """The paragraphs of a control file, as dictionaries; a field's lines stay as they are."""
    for block in re.split(r"\n\s*\n", text):
        fields = dict(re.findall(r"^([\w-]+):[ \t]*(.*(?:\n[ \t].*)*)", block, re.MULTILINE))
        if fields:
            yield fields


def fields_of_deb(file):
    text = subprocess.run(["dpkg-deb", "--field", file], check=True, capture_output=True, text=True)
    return next(paragraphs(text.stdout))


def dependencies(fields):
    """The names in Depends: a list of alternatives for each package."""
    for group in filter(str.strip, fields.get("Depends", "").split(",")):
        yield [re.match(r"\s*([\w.+-]+)", name).group(1) for name in group.split("|")]


class Package:
    """One that is installed: its name, version, architecture, source and description of licences."""

    def __init__(self, fields, root):
        self.name = fields["Package"]
        self.version = fields["Version"]
        self.architecture = fields["Architecture"]
        self.provides = re.findall(r"(?:^|,)\s*([\w.+-]+)", fields.get("Provides", ""))
        self.source = fields.get("Source", self.name).partition(" ")[0]
        self._copyright = root / "usr/share/doc" / self.name / "copyright"

    def licence_paragraphs(self):
        """The paragraphs of its copyright file; none where that is missing or not for machines."""
        try:
            text = self._copyright.read_text(errors="replace")
        except OSError:
            return []
        all_paragraphs = list(paragraphs(text))
        is_parsable = all_paragraphs and "Format" in all_paragraphs[0]
        return all_paragraphs if is_parsable else []


class Installed:
    """The installed packages of the file system at a root, in the order of their names."""

    def __init__(self, root):
        self._root = root
        status = (root / "var/lib/dpkg/status").read_text()
        packages = [Package(fields, root) for fields in paragraphs(status)
                    if fields.get("Status", "").endswith(" installed")]
        self._by_name = {package.name: package for package in sorted(packages, key=lambda p: p.name)}
        self._providers = {name: package for package in packages for name in package.provides}

    def __iter__(self):
        return iter(self._by_name.values())

    def find(self, name):
        """The package of a name, or one that provides it; None if neither is installed."""
        return self._by_name.get(name) or self._providers.get(name)

    def _owners(self):
        """The package of each header and of each archive."""
        owners = {}
        for file in (self._root / "var/lib/dpkg/info").glob("*.list"):
            name = file.name.removesuffix(".list").partition(":")[0]
            for line in file.read_text().splitlines():
                if "/include/" in line or line.endswith(".a"):
                    owners[line] = name
        return owners

    def compiled_in(self, build, programs):
        """Packages whose headers or archives programs of a build are made of, by name."""
        def ninja(*arguments):
            return subprocess.run(["ninja", "-C", build, "-t", *arguments], check=True,
                                  capture_output=True, text=True).stdout.splitlines()

        inputs = {line for program in programs for line in ninja("inputs", program)}
        files = {line for line in inputs if line.endswith(".a")}
        is_input = False
        for line in ninja("deps"):
            if line and not line.startswith(" "):
                is_input = line.partition(":")[0] in inputs
            elif is_input:
                files.add(line.strip())
        owners = self._owners()
        names = {owners.get(str(pathlib.Path(file).resolve()), owners.get(file)) for file in files}
        return [package for package in self
                if package.name in names and package.source not in TOOLCHAIN]
