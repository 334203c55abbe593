"""What the multi-target tracker's kernels count and tell, in words."""

from wideberth.tracking.multi_target import hearing_kernels as heard
from wideberth.tracking.multi_target import identity_kernels as identity
from wideberth.tracking.multi_target.buffers_kernels import (
    BIRTHS_DEFERRED,
    CONFIRMED_NOW,
    LARGE_CLUSTERS,
    LEFT_VIEW,
    LOST,
    MERGED,
    NOT_SCANNED,
    PLOTS_NOT_FINITE,
    PLOTS_OUT_OF_RANGE,
    PLOTS_SHED,
    TOO_UNCERTAIN,
)

EVENTS = {
    CONFIRMED_NOW: "track {} confirmed",
    LOST: "track {} lost: no longer seen",
    LEFT_VIEW: "track {} lost: outside every field of view",
    MERGED: "track {} ended: the same aircraft as track {}",
    TOO_UNCERTAIN: "track {} lost: too uncertain",
    NOT_SCANNED: "track {} lost: no scan for too long",
}

COUNTERS = {
    PLOTS_NOT_FINITE: "plot not finite",
    PLOTS_OUT_OF_RANGE: "plot out of range",
    PLOTS_SHED: "plot shed",
    BIRTHS_DEFERRED: "birth deferred",
    LARGE_CLUSTERS: "cluster shared out",
}

REPORT_EVENTS = {
    identity.HEARD_NOW: "track {track} confirmed: it is {name}",
    identity.IS: "track {track} is {name}",
    identity.ONE_WITH: "track {other} ended: the same aircraft as track {track}, {name}",
    identity.IS_NOT: "track {track} is no longer {name}: its reports go another way",
    identity.CARRIED_ON: "track {track}, {name}, goes on by its reports alone",
    identity.FALLEN_SILENT: "track {track}, {name}, lost: no reports for too long",
    identity.MOVED: "track {track}, {name}, lost: its reports go on elsewhere as track {other}",
    identity.NO_MORE_HEARD: "track {track} goes on without reports of {name}",
    identity.NOT_SEEN: "track {track} lost: no longer seen, and not where {name} is",
}
"""Events with the track, another track, and the name of the aircraft."""

REPORT_COUNTERS = {
    heard.USED: "position accepted",
    heard.NO_POSITION: "report without position used",
    heard.NOT_NEW: "position not new",
    heard.NO_PLACE: "no position yet",
    heard.NO_HEIGHT: "no altitude yet",
    heard.OUTSIDE: "position outside the gate",
    heard.SECOND_USER: "address used twice",
    heard.SHARED: "report without position of a shared address",
    heard.STARTED: "track started by a report",
    heard.AGAIN: "track started again by reports",
    heard.LATE: "position late: where its aircraft was",
    heard.ALTITUDE_OUTSIDE: "altitude outside the gate",
    heard.CLIMB_OUTSIDE: "climb rate outside the gate",
    heard.VELOCITY_OUTSIDE: "velocity outside the gate",
    heard.TRACK_OUTSIDE: "report outside the gate of its radar track",
    heard.ALTITUDE_AGAIN: "altitude restarted",
}
