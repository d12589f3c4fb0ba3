/*
 * The station: everything that captures and solves, and the states it goes through. Owned by the
 * control thread, on which all calls run.
 */
#pragma once

#include "base/exit_codes.h"
#include "config/stage.h"
#include "daemon/capture.h"
#include "daemon/pulses.h"
#include "daemon/reopen.h"
#include "daemon/rig_swap.h"
#include "daemon/solver.h"
#include "daemon/station_states.h"
#include "daemon/statistics.h"
#include "daemon/trigger_reopen.h"
#include "daemon/virtual_time.h"

struct station {
	enum station_state state;
	struct stage stage;
	const struct trigger_plan *plan;     /* that it runs by: the config's, or a calibration's */
	struct capture captures[CAMERA_MAX]; /* of stage.config.camera_count */
	struct pulses pulses;
	struct solver solver;
	struct shot_copy shot_copy;
	struct reopener reopener;
	struct trigger_reopener trigger_reopener;
	struct rig_swap rig_swap;
	struct statistics statistics;
	struct virtual_time virtual_time;
	struct pictures_share pictures; /* while calibrating */
	int64_t period_ns; /* between shots: of the trigger's plan, or as the cameras run */
	int wake_fd;       /* eventfd: marker sets or previews are ready, or a camera changed */
	bool world_open;
	bool memory_locked;
	bool hung; /* a thread did not end: nothing may be freed, only the process can go */
	int64_t started_ns;       /* of the run; 0 = none yet */
	bool unnamed_told;        /* logged once a run */
	uint64_t newest_shot;     /* handed to the subscribers; LOG_NO_SHOT = none yet */
	uint64_t sim_late_before; /* frames that the simulator was late with before the run */
	uint32_t run;             /* times that it was started; shots are numbered anew in each */
};

/* Reads the files; no device is touched. On failure all messages are in `diag`, nothing is held,
 * and the exit code that fits is returned. */
enum exit_code station_load(struct station *station, const char *config_path, struct diag *diag);

/* What is said of a rig directory that does not exist. */
#define STATION_NO_RIG                                                                             \
	"%s: there is no rig yet: start staged with --idle, and stagectl calibrate cameras makes " \
	"one"

/* Without one, which it may be loaded without, it can calibrate and not run. Once configured. */
bool station_has_rig(const struct station *station);

/* idle -> configured, of a station that was loaded: opens and checks the devices. Fails as
 * station_load(). */
enum exit_code station_configure(struct station *station, struct diag *diag);

/* configured -> running (STATION_START) or calibrating (STATION_CALIBRATE); all counters begin
 * anew. A camera that is gone is lost, not a failure. On failure it is configured again; from
 * another state: EXIT_CODE_RUNNING. */
enum exit_code station_start(struct station *station, enum station_event how, struct diag *diag);

/* running, calibrating or ended -> configured. False from another state. Strobes are dark when it
 * returns, whatever hangs. */
bool station_stop(struct station *station);

/* -> idle; a zeroed station is fine. While a thread hangs or a lost camera is being opened it frees
 * nothing, and returns false: then the process can only go. */
bool station_finish(struct station *station);

/* Once a second: statistics, lost cameras, the end of recordings. */
void station_tick(struct station *station);

/* The next marker set for the subscribers, or NULL; valid until station_pop_set(), which takes it
 * as sent. */
const struct marker_set *station_next_set(struct station *station);
void station_pop_set(struct station *station);

/* What camera `index` is asked for by the plan that the station runs by. */
struct camera_mode station_wanted(const struct station *station, uint32_t index);

/* Seconds for which what the cameras see has had no names, 0 while it has; running, after two. */
double station_unnamed_s(const struct station *station);

const char *capture_state_name(enum capture_state state);

/* Threads that asked for SCHED_FIFO and have it: all of them. */
bool station_is_realtime(const struct station *station);
