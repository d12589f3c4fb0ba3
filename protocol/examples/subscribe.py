#!/usr/bin/python3
"""A smallest subscriber: prints one line per second."""
import sys

import stageclient


def main(path):
    second = None
    with stageclient.connect(path) as stream:
        for event in stream:
            if isinstance(event, stageclient.Description):
                print(f"{len(event.cameras)} cameras, {len(stream.labels)} labels, rig {event.rig_revision}")
            elif isinstance(event, stageclient.Notice):
                print(f"the station says: {event.text}")
            elif isinstance(event, stageclient.Statistics) and event.HasField("unnamed"):
                print(f"no names for {event.unnamed.seconds:.0f} s: {event.unnamed.remedy}", flush=True)
            elif isinstance(event, stageclient.MarkerSet) and event.mid_exposure_ns // 10**9 != second:
                second = event.mid_exposure_ns // 10**9
                named = sum(m.label >= 0 and m.status >= stageclient.TWO_CAMERA for m in event.markers)
                print(f"shot {event.shot}: {named} named markers seen, {stream.sets_lost} sets lost",
                      flush=True)


if __name__ == "__main__":
    try:
        main(sys.argv[1] if len(sys.argv) > 1 else "/run/stage/stream.sock")
    except KeyboardInterrupt:
        pass
    except OSError as error:
        sys.exit(f"subscribe: {error}: is the station running?")
