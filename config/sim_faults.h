/*
 * The list of faults that the simulator is told to make: key sim.faults.
 */
#pragma once

#include <stdint.h>

#include "track/layout.h"

#define SIM_FAULT_MAX 32

enum sim_fault_kind {
	SIM_FAULT_DROP,        /* counted by the device, not handed over */
	SIM_FAULT_MISS,        /* neither exposed nor counted */
	SIM_FAULT_DELAY,       /* handed over late */
	SIM_FAULT_REPEAT,      /* handed over twice */
	SIM_FAULT_SHIFT,       /* the image of the shot before, with this one's counter and time */
	SIM_FAULT_STAMP_SHIFT, /* the time of the shot behind */
	SIM_FAULT_FREEZE,      /* as miss, for all of the time */
	SIM_FAULT_UNPLUG,      /* the device is gone; when it is back it counts from 0 */
	SIM_FAULT_DARK,        /* the strobe is dead */
	SIM_FAULT_PHASE_SLIP,  /* HD: exposed one shot late */
	SIM_FAULT_STUCK_EXPOSURE, /* the shutter stays open over the strobes of three shots */
	SIM_FAULT_BUMP,           /* it looks elsewhere by angle_mrad */
	SIM_FAULT_CLOCK_STEP,     /* its clock, and so its time stamps, are step_ms off */
	SIM_FAULT_SLOW_DISK,      /* a recording's images take delay_ms to read */
	SIM_FAULT_STROBE_LEAK,    /* HD: it sees the IR strobes' light */
};

struct sim_fault {
	char camera[NAME_BYTES];
	int kind;                /* enum sim_fault_kind; -1 while it could not be read */
	double at_s, for_s;      /* scene time; for_s 0: to the end */
	int every;               /* of the frames in that time every Nth, from the first */
	double delay_ms;         /* of SIM_FAULT_DELAY and SIM_FAULT_SLOW_DISK */
	double angle_mrad;       /* of SIM_FAULT_BUMP */
	double step_ms;          /* of SIM_FAULT_CLOCK_STEP */
	char device[NAME_BYTES]; /* behind "sim:" in the camera's address; of a recording its name
				  */
	int line, column;        /* in the file, for messages */
};

struct sim_faults {
	uint32_t count;
	struct sim_fault faults[SIM_FAULT_MAX];
};

struct yaml;
struct yaml_value;

void sim_faults_read(struct yaml *yaml, const struct yaml_value *value, struct sim_faults *faults);

enum sim_fault_of { SIM_FAULT_OF_IR, SIM_FAULT_OF_HD, SIM_FAULT_OF_RECORDING };

/* A kind that this sort of camera cannot have is a message. */
void sim_fault_check_kind(struct yaml *yaml, const struct sim_fault *fault, enum sim_fault_of of,
			  const char *field);

struct config_camera;

/* Once the cameras are read: each fault's camera must be one of them, and simulated or
 * recorded. */
void sim_faults_finish(struct yaml *yaml, struct sim_faults *faults,
		       const struct config_camera *cameras, uint32_t camera_count);
