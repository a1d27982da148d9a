#!/usr/bin/python3
"""Checks the templates of deploy/farm for OpenCue and OpenJD, without these programs.

  check_templates.py check CHECKOUT
  check_templates.py self-test CHECKOUT
  check_templates.py opencue-command CHECKOUT          the layer's command
  check_templates.py openjd-command CHECKOUT [NAME=VALUE ..]
                                                       the action's command with these parameters

- opencue/workers.xml: elements, their order and attributes are those of the public cjsl 1.13, and
  values are as Cuebot reads them.
- openjd/workers.yaml: keys, types, values and references of format strings are those of the public
  schema jobtemplate-2023-09 without extensions, as far as the template uses it. What it does not use
  is refused as unknown.
- Both give a worker the same memory: four fifths of the task's.
- A frame of workers.xml whose --max-time is over fails, and is tried again. OpenCue would take a
  success for the end of the work.
Exit: 0 if all is as it should be; 1 if not, with a line for each fault; 2 usage.
"""

import copy
import pathlib
import re
import shlex
import sys
import xml.etree.ElementTree

import yaml

# The children of an element, in their order: ? may be missing, * may be missing or repeated.
CUE_CHILDREN = {
    "spec": "facility? dept? show shot user email? uid? job* depends*",
    "job": "paused? priority? maxretries? maxcores? maxgpus? autoeat? localbook? os? env* layers?",
    "layers": "layer layer*",
    "layer": "cmd range chunk cores? threadable? memory? gpus? gpu? gpu_memory? timeout? "
    "timeout_llu? tags? limits? env* services?",
    "services": "service service*",
}
CUE_ATTRIBUTES = {
    "job": {"name": r"[\w.-]{3,}"},
    "layer": {"name": r"[\w.-]{3,}", "type": "Render|Util|Post"},
}
CUE_VALUES = {
    "shot": r"[\w.-]{3,}",
    "user": r"(?!root$)\w+",
    "paused": "True|False",
    "autoeat": "True|False",
    "threadable": "True|False",
    "maxretries": "[01]",
    "range": r"\d+-\d+",
    "chunk": r"[1-9]\d*",
    "cores": r"\d+\.\d+",
    "memory": r"\d+[gm]",
}


def cue_faults(element):
    children = " ".join(child.tag for child in element)
    words = CUE_CHILDREN.get(element.tag, "").split()
    order = "".join(
        rf"( {word[:-1]}){word[-1]}" if word[-1] in "?*" else f" {word}" for word in words
    )
    if not re.fullmatch(order, f" {children}" if children else ""):
        yield f"<{element.tag}> has: {children or 'nothing'}; allowed: {' '.join(words) or 'text'}"
    attributes = CUE_ATTRIBUTES.get(element.tag, {})
    if set(element.attrib) != set(attributes):
        yield f"<{element.tag}> has attributes {sorted(element.attrib)}, not {sorted(attributes)}"
    for name, pattern in attributes.items():
        if not re.fullmatch(pattern, element.get(name, "")):
            yield f"<{element.tag} {name}>: {element.get(name)!r} is not {pattern}"
    text = (element.text or "").strip()
    pattern = CUE_VALUES.get(element.tag, "" if words else ".+")
    if not re.fullmatch(pattern, text):
        yield f"<{element.tag}>: {text!r} is not {pattern or 'empty'}"
    for child in element:
        yield from cue_faults(child)


IDENTIFIER = re.compile(r"[A-Za-z_]\w{0,63}", re.ASCII)
REFERENCE = re.compile(r"\{\{\s*([\w.]+)\s*\}\}")
# A value: a Python type, a set of words, a pattern, a list of one kind of value, or an object: a
# dict of its keys, where a ? marks what may be missing.
PARAMETER = {"name": IDENTIFIER, "description?": str}
PARAMETERS = {
    "PATH": {**PARAMETER, "type": {"PATH"}, "objectType?": {"FILE", "DIRECTORY"},
             "dataFlow?": {"NONE", "IN", "OUT", "INOUT"}, "default?": str},
    "INT": {**PARAMETER, "type": {"INT"}, "minValue?": int, "maxValue?": int, "default?": int},
    "STRING": {**PARAMETER, "type": {"STRING"}, "default?": str},
}
CANCELATION = {"mode": {"NOTIFY_THEN_TERMINATE"}, "notifyPeriodInSeconds?": int}
ACTION = {"command": str, "args?": [str], "timeout?": int, "cancelation?": CANCELATION}
STEP = {
    "name": re.compile(r".{1,64}"),
    "parameterSpace?": {
        "taskParameterDefinitions": [{"name": IDENTIFIER, "type": {"INT"}, "range": str}]
    },
    "hostRequirements?": {
        "amounts?": [{"name": re.compile(r"amount\.worker\.(vcpu|memory)"), "min": int}],
        "attributes?": [{"name": {"attr.worker.os.family"}, "anyOf": [{"linux"}]}],
    },
    "script": {"actions": {"onRun": ACTION}},
}
TEMPLATE = {
    "specificationVersion": {"jobtemplate-2023-09"},
    "name": re.compile(r".{1,128}"),
    "description?": str,
    "parameterDefinitions?": [PARAMETERS],
    "steps": [STEP],
}


def value_faults(value, kind, where):
    if kind is PARAMETERS:
        kind = PARAMETERS.get(value.get("type") if isinstance(value, dict) else None)
        if kind is None:
            yield f"{where}: {value!r} is no definition of a parameter"
            return
    if isinstance(kind, dict):
        yield from object_faults(value, kind, where)
    elif isinstance(kind, list):
        if not isinstance(value, list) or not value:
            yield f"{where}: {value!r} is not a list of something"
            return
        for k, item in enumerate(value):
            yield from value_faults(item, kind[0], f"{where}[{k}]")
    elif isinstance(kind, type):
        if type(value) is not kind:
            yield f"{where}: {value!r} is not of type {kind.__name__}"
    elif isinstance(kind, re.Pattern):
        if not isinstance(value, str) or not kind.fullmatch(value):
            yield f"{where}: {value!r} is not {kind.pattern}"
    elif value not in kind:
        yield f"{where}: {value!r} is not one of {sorted(kind)}"


def object_faults(value, kinds, where):
    if not isinstance(value, dict):
        yield f"{where}: {value!r} is not an object"
        return
    kinds = {name.rstrip("?"): (kind, name[-1] == "?") for name, kind in kinds.items()}
    yield from (f"{where}: unknown key {name}" for name in value if name not in kinds)
    for name, (kind, may_be_missing) in kinds.items():
        if name in value:
            yield from value_faults(value[name], kind, f"{where}.{name}")
        elif not may_be_missing:
            yield f"{where}: no {name}"


def strings_of(value):
    if isinstance(value, str):
        yield value
    elif isinstance(value, (dict, list)):
        for item in value.values() if isinstance(value, dict) else value:
            yield from strings_of(item)


def openjd_faults(template):
    faults = list(value_faults(template, TEMPLATE, "template"))
    if faults:
        return faults
    definitions = template.get("parameterDefinitions", [])
    names = [definition["name"] for definition in definitions]
    faults += [f"two parameters {name}" for name in set(names) if names.count(name) > 1]
    for step in template["steps"]:
        tasks = step.get("parameterSpace", {}).get("taskParameterDefinitions", [])
        known = {f"{scope}.{name}" for scope in ["Param", "RawParam"] for name in names}
        in_script = known | {f"Task.Param.{task['name']}" for task in tasks}
        paths = {f"Param.{d['name']}" for d in definitions if d["type"] == "PATH"}
        for text in strings_of({key: part for key, part in step.items() if key != "script"}):
            faults += [f"{name} is not known in {text!r}"
                       for name in REFERENCE.findall(text) if name not in known - paths]
        for text in strings_of(step["script"]):
            faults += [f"{name} is not known in {text!r}"
                       for name in REFERENCE.findall(text) if name not in in_script]
    return faults


def memory_faults(of, flags, task_mib):
    given = re.search(r"--memory (\d+)MiB", flags)
    if not given or abs(int(given.group(1)) - 0.8 * task_mib) > 0.05 * task_mib:
        yield f"{of}: --memory is not four fifths of the task's {task_mib} MiB: {flags}"


def threads_faults(of, flags, cores):
    if f"--threads {cores} " not in flags:
        yield f"{of}: --threads is not the task's {cores} cores: {flags}"


def end_faults(of, flags, retries):
    if "--max-time " not in flags:
        return
    if not re.search("--stopped-status [1-9]", flags):
        yield f"{of}: a worker succeeds at the end of --max-time: {flags}"
    if retries != "1":
        yield f"{of}: a worker is not tried again after the end of --max-time: {retries} retries"


def openjd_command(template, values):
    """The words of the first step's action."""
    parameters = {f"Param.{definition['name']}": str(values.get(definition["name"],
                                                                 definition.get("default")))
                  for definition in template.get("parameterDefinitions", [])}
    action = template["steps"][0]["script"]["actions"]["onRun"]
    return [REFERENCE.sub(lambda match: parameters[match.group(1)], word)
            for word in [action["command"], *action.get("args", [])]]


def all_faults(spec, template):
    faults = [f"workers.xml: {fault}" for fault in cue_faults(spec)]
    faults += [f"workers.yaml: {fault}" for fault in openjd_faults(template)]
    if faults:
        return faults
    layer = spec.find("job/layers/layer")
    command = layer.findtext("cmd")
    memory = layer.findtext("memory")
    mib = int(memory[:-1]) * (1024 if memory[-1] == "g" else 1)
    faults += memory_faults("workers.xml", command, mib)
    faults += threads_faults("workers.xml", command, int(float(layer.findtext("cores"))))
    faults += end_faults("workers.xml", command, spec.findtext("job/maxretries"))
    amounts = {amount["name"]: amount["min"]
               for amount in template["steps"][0]["hostRequirements"]["amounts"]}
    command = shlex.join(openjd_command(template, {}))
    faults += memory_faults("workers.yaml", command, amounts["amount.worker.memory"])
    faults += threads_faults("workers.yaml", command, amounts["amount.worker.vcpu"])
    return faults


def self_test(spec, template):
    """Each of these changes must be found."""
    def with_spec(change):
        changed = copy.deepcopy(spec)
        change(changed)
        return changed, template

    def with_template(change):
        changed = copy.deepcopy(template)
        change(changed)
        return spec, changed

    def layer(changed):
        return changed.find("job/layers/layer")

    def step(changed):
        return changed["steps"][0]

    def action(changed):
        return step(changed)["script"]["actions"]["onRun"]

    changes = {
        "an unknown element": with_spec(lambda s: layer(s).append(s.makeelement("mem", {}))),
        "another order": with_spec(lambda s: layer(s).insert(0, layer(s)[-1])),
        "a missing element": with_spec(lambda s: layer(s).remove(layer(s).find("range"))),
        "an unknown type": with_spec(lambda s: layer(s).set("type", "Work")),
        "root": with_spec(lambda s: setattr(s.find("user"), "text", "root")),
        "more cores": with_spec(lambda s: setattr(layer(s).find("cores"), "text", "4.0")),
        "less memory": with_spec(lambda s: setattr(layer(s).find("memory"), "text", "2g")),
        "no retries": with_spec(lambda s: setattr(s.find("job/maxretries"), "text", "0")),
        "success at the end of the time": with_spec(lambda s: setattr(
            layer(s).find("cmd"), "text", layer(s).findtext("cmd").split(" --stopped-status")[0])),
        "an unknown key": with_template(lambda t: t.update(extra=1)),
        "another version": with_template(lambda t: t.update(specificationVersion="1")),
        "no steps": with_template(lambda t: t.pop("steps")),
        "an unknown parameter": with_template(lambda t: action(t).update(command="{{Param.X}}")),
        "a number as argument": with_template(lambda t: action(t)["args"].append(2)),
        "a path outside of a script": with_template(
            lambda t: step(t)["parameterSpace"]["taskParameterDefinitions"][0].update(
                range="{{Param.RunWorker}}")),
        "another way to cancel": with_template(
            lambda t: action(t)["cancelation"].update(mode="KILL")),
        "more memory": with_template(
            lambda t: step(t)["hostRequirements"]["amounts"][1].update(min=9000)),
    }
    assert not all_faults(spec, template)
    missed = [what for what, changed in changes.items() if not all_faults(*changed)]
    print("\n".join(f"not found: {what}" for what in missed) or "self-test passed")
    sys.exit(1 if missed else 0)


def main():
    arguments = sys.argv[1:]
    if arguments == ["--help"]:
        print(__doc__)
        return
    commands = ["check", "self-test", "opencue-command", "openjd-command"]
    if len(arguments) < 2 or arguments[0] not in commands:
        print(__doc__, file=sys.stderr)
        sys.exit(2)
    command, folder = arguments[0], pathlib.Path(arguments[1]) / "deploy" / "farm"
    spec = xml.etree.ElementTree.parse(folder / "opencue" / "workers.xml").getroot()
    template = yaml.safe_load((folder / "openjd" / "workers.yaml").read_text())
    if command == "self-test":
        self_test(spec, template)
    if command == "opencue-command":
        print(spec.findtext("job/layers/layer/cmd"))
    if command == "openjd-command":
        values = dict(argument.split("=", 1) for argument in arguments[2:])
        print(shlex.join(openjd_command(template, values)))
    if command == "check":
        faults = all_faults(spec, template)
        print("\n".join(faults) or "both templates are as they should be")
        sys.exit(1 if faults else 0)


main()
