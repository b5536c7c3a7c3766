"""Lists plug-ins of other packages, and those that cannot be used."""

from groundstation import plug_ins
from groundstation.doctor.finding import Finding, Level
from groundstation.vehicles import refused_kinds

_GROUPS = (plug_ins.CAMERAS, plug_ins.PLANNERS, plug_ins.WORLD_SENSORS, plug_ins.MARKERS)


def plug_in_findings() -> list[Finding]:
    """Return a finding for each plug-in; each is loaded, but not instantiated."""
    refused = refused_kinds()
    found = [_finding(plug_ins.VEHICLES, name, refused.get(name, "")) for name in plug_ins.names(plug_ins.VEHICLES)]
    found += [_finding(group, name, _why_not(group, name)) for group in _GROUPS for name in plug_ins.names(group)]
    if damage := plug_ins.damage():
        found.append(Finding(Level.SHOULD, "plug-ins", damage.removeprefix("; "), "its plug-ins cannot be found"))
    return found


def _why_not(group: str, name: str) -> str:
    try:
        plug_ins.load(group, name)
    except plug_ins.PlugInError as error:
        return str(error).removeprefix(f"{name} cannot be used: ")
    return ""


def _finding(group: str, name: str, why_not: str) -> Finding:
    if why_not:
        return Finding(Level.SHOULD, f"{group} {name}", why_not, "mend or uninstall that package; all else works")
    return Finding(Level.OK, f"{group} {name}", "can be loaded")
