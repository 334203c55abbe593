"""Flying for real: sockets, serial ports and clocks around the same corridor as everywhere else."""

# The kinds of the tables `[autopilot]` and `[[inputs]]`.
AUTOPILOTS: dict[str, str] = {"mavlink": "wideberth.links.mavlink.autopilot:Autopilot"}

INPUTS: dict[str, str] = {
    "radar_udp": "wideberth.live.radar_input:RadarUdpInput",
    "asterix": "wideberth.live.asterix_input:AsterixInput",
    "gdl90": "wideberth.live.traffic_input:Gdl90Input",
    "uat": "wideberth.live.traffic_input:UatInput",
    "beast": "wideberth.live.traffic_input:BeastInput",
    "sbs": "wideberth.live.traffic_input:SbsInput",
    "avr": "wideberth.live.traffic_input:AvrInput",
    "autopilot": "wideberth.live.traffic_input:AutopilotInput",
}
