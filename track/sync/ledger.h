/*
 * The pulse ledger: which pulse of the trigger each frame belongs to. The pulse nearest to its
 * exposure, within half a period, and the device's own frame counter must name the same shot; where
 * they disagree the frame is put right when the two leave only one explanation, else refused. Every
 * such event is named and counted. Flat, pure, deterministic; docs/faults.md says how each is
 * found.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#include "track/label/edges.h"
#include "track/observe.h"

#define LEDGER_MOVED_PX 0.12 /* a picture that lies off by as much was not calibrated so */

enum ledger_event {
	LEDGER_DROPPED,        /* counted by the device, not delivered */
	LEDGER_MISSED_TRIGGER, /* a pulse that the camera neither exposed on nor counted */
	LEDGER_REPEATED,       /* the same frame again: refused */
	LEDGER_LATE,           /* its shot was closed when it came: refused */
	LEDGER_SHIFTED,        /* its time named another shot; put right by the counter */
	LEDGER_DOUBTFUL,       /* counter and time disagree and nothing decides: refused */
	LEDGER_RESTARTED,      /* the counter began anew */
	LEDGER_COUNTER_JUMPED, /* the counter went on by more than the exposures did */
	LEDGER_PHASE_SLIPPED,  /* an HD frame exposed in another shot than the plan's phase says */
	LEDGER_SLOWER_THAN_TRIGGER, /* it delivers only every second (third, ...) shot: once */
	LEDGER_OUT_OF_STEP,   /* its images are of another shot, says what the others see: once */
	LEDGER_DARK,          /* it sees nothing where others see markers: strobe dead? once */
	LEDGER_OVEREXPOSED,   /* its spots are saturated where others' are not: exposure stuck? once
			       */
	LEDGER_MOVED,         /* it looks elsewhere than its calibration says: bumped? once */
	LEDGER_CLOCK_STEPPED, /* its clock jumped: its times are put right from then on */
	LEDGER_EVENT_COUNT
};

/* "dropped", "missed_trigger", ... as in status; NULL beyond the last. */
const char *ledger_event_name(enum ledger_event event);

struct ledger_line {
	uint64_t seq, shot; /* of one frame on it */
	uint32_t stride;    /* shots per count of the device's counter */
	uint32_t count;     /* frames in a row that lie on it, as far as matters */
};

struct ledger_camera {
	/* of the plan */
	uint32_t divider;  /* shots per exposure: 1, or the HD divider */
	uint32_t phase;    /* exposes in shots with shot % divider == phase */
	bool never_late;   /* no shot waits for it */
	int64_t offset_ns; /* of its mid-exposure behind that of the IR cameras */

	/* counter and shot as they went together so far, and what has contradicted them since */
	struct ledger_line line, rival;
	bool started;
	bool repeat_counted;  /* the last frame was a repeat that the device had counted */
	uint32_t returned;    /* frames in a row on the old line, refused while it is disputed */
	uint32_t refused_run; /* frames that came since the line's last one, and were refused */
	uint64_t seen_seq;    /* of the last frame that came, refused or not */
	int64_t seen_mid_exposure_ns;

	/* how it usually comes */
	int64_t lag_ns;         /* mean of frame's time - edge's */
	int64_t arrival_min_ns; /* least time from mid-exposure to arrival */
	uint32_t arrivals;      /* that it was learned from */
	int64_t clock_off_ns;   /* what its clock has jumped by */
	int64_t clock_seen_ns;  /* a jump that has yet to last, and for how many frames it did */
	uint32_t clock_run;
	uint32_t gap, gap_run; /* shots between delivered frames / divider, and how often so */

	/* told by what it shows */
	bool slower, out_of_step, dark, overexposed, moved;
	uint32_t dark_run, overexposed_run;
	double moved_px,
		moved_mrad; /* how far its picture seems off; 0: another one seems, or none */

	/* for status */
	uint32_t slip; /* last frame's shot % divider, from the phase on */
	uint64_t counts[LEDGER_EVENT_COUNT];
	uint64_t event_shot; /* of the last event */
	uint32_t event;      /* enum ledger_event, once a count is not 0 */
};

/* Set up by ledger_init(), ledger_set_camera() and edges.period_ns. */
struct ledger {
	struct edges edges;
	bool closed_any;
	uint64_t closed_shot; /* the newest */
	struct ledger_camera cameras[CAMERA_MAX];
};

void ledger_init(struct ledger *ledger, int64_t period_ns);

/* An HD camera: exposes in shots with shot % divider == phase, offset_ns after the IR cameras, and
 * no shot waits for it. Without this call it is an IR camera: it exposes in every shot. */
void ledger_set_camera(struct ledger *ledger, uint32_t camera, uint32_t divider, uint32_t phase,
		       int64_t offset_ns);

struct ledger_frame {
	uint64_t device_seq;
	int64_t mid_exposure_ns;
	int64_t arrival_ns;
};

enum ledger_verdict {
	LEDGER_TAKE,  /* it is of the shot named */
	LEDGER_WAIT,  /* its pulse may still be reported; ask again */
	LEDGER_EARLY, /* exposed before the first pulse: drop it */
	LEDGER_REFUSE /* dropped, and counted in the camera's counts */
};

/* Judges the next frame of a camera, each frame once unless LEDGER_WAIT. `final`: no more pulses
 * are waited for, the shot is counted on from the last one. On LEDGER_TAKE `shot` and
 * `mid_exposure_ns` (the frame's own, or put right) are set. */
enum ledger_verdict ledger_judge(struct ledger *ledger, uint32_t camera,
				 const struct ledger_frame *frame, bool final, uint64_t *shot,
				 int64_t *mid_exposure_ns);

/* The same where no pulses are known: only repeats are refused, and drops counted. */
enum ledger_verdict ledger_watch(struct ledger *ledger, uint32_t camera,
				 const struct ledger_frame *frame);

/* Where no pulses are known: a frame came when its shot was closed. */
void ledger_note_late(struct ledger *ledger, uint32_t camera, uint64_t shot);

/* Shots up to this one are closed: frames of them are late from now on. */
void ledger_close(struct ledger *ledger, uint64_t shot);

/* From step_check: what share of a shot's motion the camera's image is off by; -1: it shows the
 * shot before. */
void ledger_note_step(struct ledger *ledger, uint32_t camera, uint64_t shot, double off_shots);

/* From ledger_judge: an accepted frame's time is so far from where its camera's times usually lie.
 * False: nothing is to be learned from it. */
bool ledger_note_clock(struct ledger *ledger, uint32_t camera, uint64_t shot, int64_t off_ns);

/* From aim_check: by how much the camera's picture is off. */
void ledger_note_aim(struct ledger *ledger, uint32_t camera, uint64_t shot, double shift_px,
		     double turn_mrad);

/* Of one camera in a shot. */
struct ledger_blobs {
	int32_t count;     /* negative: it has no frame there */
	int32_t saturated; /* of them */
};

/* Blobs of the cameras in a closed shot. */
void ledger_note_blobs(struct ledger *ledger, uint64_t shot, const struct ledger_blobs *blobs,
		       uint32_t camera_count);
