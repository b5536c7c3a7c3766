"""The findings of a report beyond its figures: consistency, decisions, interventions, links, failsafes, doubts."""

import msgspec

from groundstation.report.consistency import EdgeConsistency, edges
from groundstation.report.decisions import Intervention, interventions, switches
from groundstation.report.happenings import Happening, happenings
from groundstation.report.links import VehicleLink, links
from groundstation.report.tracks import RunData
from groundstation.report.trust import Trust, trust_of
from groundstation.sensing.switches import Switch


class Findings(msgspec.Struct, frozen=True):
    """Lists of findings, for people and programs; their types explain them."""

    edges: list[EdgeConsistency]
    switches: list[Switch]
    interventions: list[Intervention]
    links: list[VehicleLink]
    happenings: list[Happening]
    trust: Trust


def findings_of(data: RunData) -> Findings:
    """Return the findings of a run."""
    return Findings(edges(data), switches(data), interventions(data), links(data), happenings(data), trust_of(data))
