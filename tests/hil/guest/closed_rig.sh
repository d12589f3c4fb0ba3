# closed_rig TRIGGER [usb]: the station on this trigger, which fires the lines IR_TRIG and STROBE of
# stage-sim, and two USB cameras on its pulses.
closed_rig() {
	dir=$(mktemp -d)
	cat >"$dir/stage.yaml" <<-END
		rig: $BUILD/hil-pictures/rig
		layout: $BUILD/hil-pictures/layout.yaml
		trigger: "$1"
		rate_hz: 5
		exposure_us: 60000
		strobe_width_us: 50000
		strobe_duty_max: 0.5
		cameras:
		- {name: ir0, address: "v4l2:serial=IR0", exposure_us: 20000} # its frames come before their pulse was reported
		- {name: ir1, address: "v4l2:serial=IR1", exposure_us: 60000}
	END
	shift
	run "$BUILD/tests/hil/closed_rig" "$BUILD" "$device" "$dir" "$@"
}
