/*
 * The simulated stage of this process: one scene that every sim: camera and the sim trigger look
 * at. It is process-wide because a driver's open() has no way to be told which scene: the program
 * opens the world before it opens any of its devices, and closes it after the last one.
 */
#pragma once

#include <stdint.h>

#include "base/diag.h"
#include "drivers/camera.h"
#include "drivers/trigger.h"
#include "sim/world/scene.h"

/* `epoch_ns` is scene time 0 on CLOCK_MONOTONIC; 0 = a tenth of a second from now. Returns 0,
 * -EBUSY when a world is open already, or what sim_scene_create says. Control thread. */
int sim_world_open(const struct sim_options *options, int64_t epoch_ns, struct diag *diag);
void sim_world_close(void); /* when none is open: does nothing */

/* From now on somebody waves a calibration board before the same cameras, and scene time begins
 * anew; `options` as of sim_world_open(), with the rate of the calibration. The devices must not
 * run, and are configured anew before they start. Returns 0 or what sim_scene_create says. Control
 * thread. */
int sim_world_wave(const struct sim_options *options, struct diag *diag);
void sim_world_resume(void); /* the scene goes on, as if it had never stopped */

/* NULL while no world is open. */
const struct sim_scene *sim_world_scene(void);
int64_t sim_world_epoch_ns(void);

/* Frames that the simulator itself handed over late (not those the station fetched late), since the
 * world was opened. Any thread. */
uint64_t sim_world_late_count(uint32_t camera);

/* Cameras `sim:NAME`, IR and HD. A frame can be acquired from the end of its exposure plus a fixed
 * read-out time; the camera holds the latest 8 and drops older ones, which shows as a gap in
 * device_seq. An HD camera's device_seq counts its own frames. */
extern const struct camera_driver sim_camera_driver;

/* Trigger `sim`, or `sim:FILE` with a file for the strobes' line: reports the edge that makes each
 * shot's mid-exposure fall, by the armed plan, on epoch + sim_scene_mid_exposure_ns(shot). */
extern const struct trigger_driver sim_trigger_driver;
