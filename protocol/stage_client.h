/*
 * libstage: subscribe to a capture station's stream of labelled 3D markers.
 *
 *     struct stage_client *client;
 *     struct stage_event event;
 *     if (stage_client_open(&client, "/run/stage/stream.sock") == 0)
 *             while (stage_client_next(client, -1, &event) == 0)
 *                     ...
 *     stage_client_close(client);
 *
 * The first event is a description, then comes one marker set per shot. Metres, right-handed;
 * times are nanoseconds of the station's CLOCK_MONOTONIC. A client belongs to one thread at a time.
 */
#pragma once

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define STAGE_LABEL_NONE (-1)

enum stage_event_kind {
	STAGE_UNKNOWN = 0, /* of a newer station: ignore it */
	STAGE_DESCRIPTION = 1,
	STAGE_MARKERS = 2,
	STAGE_NOTICE = 3,
	STAGE_STATISTICS = 4,
};

struct stage_camera {
	const char *name;
	bool is_hd; /* reference video; otherwise an infrared camera that sees markers */
	uint32_t width_px, height_px;
};

/* Labels are numbered over all actors, one actor after the other. */
struct stage_label {
	const char *name;
	const char *group;
	const char *segment; /* of the body, which moves as one; empty: the head */
	uint32_t actor;
	bool rigid; /* moves with the skull */
	double diameter_m;
	double neutral_m[3]; /* head coordinates: x to the subject's left, y up, z out of the face
			      */
};

struct stage_description {
	uint32_t protocol_version;
	const char *station_version;
	const char *length_unit, *handedness, *stage_axes, *head_axes;
	const char *rig_revision; /* names the calibration */
	uint32_t rig_serial;      /* that the marker sets behind this description bear */
	uint32_t run;      /* times that the station was started; shots are numbered anew in each */
	int64_t period_ns; /* between shots; 0 = not known beforehand */
	int64_t utc_offset_ns; /* UTC since 1970 = time + offset, when this was sent */
	int64_t utc_uncertainty_ns;
	uint32_t camera_count; /* camera c is bit c of every mask */
	const struct stage_camera *cameras;
	uint32_t actor_count;
	const char *const *actors;
	uint32_t label_count;
	const struct stage_label *labels;
};

/* As numbered in stage.proto; a newer station may send others. */
enum stage_marker_status {
	STAGE_MISSING = 0,
	STAGE_PREDICTED = 1,
	STAGE_TWO_CAMERA = 2,
	STAGE_MEASURED = 3,
};

struct stage_marker {
	int32_t label;   /* index into the description's labels, or STAGE_LABEL_NONE */
	int32_t status;  /* enum stage_marker_status */
	double p_m[3];   /* stage coordinates; NaN when missing */
	float cov_m2[6]; /* xx xy xz yy yz zz; NaN when not given */
	float residual_px;
	uint32_t camera_mask, camera_count;
	float confidence;      /* that the name is right, 0 to 1; 0 without a name or unseen */
	float stabilised_m[3]; /* coordinates of the actor's head; NaN when not known */
	float normalised_m[3]; /* the same as the actor's master neutral would have it; NaN too */
	bool gone;             /* a label that has fallen off: cameras should see it and do not */
	bool ghost; /* without a name: a light that stands still on the stage or on a head */
};

/* Head to stage coordinates: p_stage = R(q) p_head + t. */
struct stage_head {
	uint32_t actor;
	double q_wxyz[4];
	double t_m[3];
	double residual_m;
	uint32_t rigid_count;
	bool jig_slip; /* the rigid markers sit elsewhere on the skull than they did */
	double slip_m; /* by how much they and the skin disagree */
};

struct stage_marker_set {
	uint64_t shot; /* a gap in it is a shot that did not arrive */
	int64_t mid_exposure_ns;
	int64_t uncertainty_ns;
	uint32_t missing_mask; /* cameras that sent nothing for this shot */
	int64_t arrival_ns, found_ns, solved_ns, sent_ns; /* when each stage was done */
	uint32_t head_count;
	const struct stage_head *heads;
	uint32_t marker_count;
	const struct stage_marker *markers;
	uint32_t markers_lost; /* unlabelled ones beyond what a set holds */
	uint64_t sets_lost;    /* sets that this subscriber has lost so far by reading too slowly */
	bool is_hd;            /* the HD cameras expose in this shot; then: */
	uint32_t hd_phase;
	uint64_t hd_index;          /* number k of their frames: shot = divider * k + phase */
	int64_t hd_mid_exposure_ns; /* of their exposure, as planned: not that of the markers */
	uint32_t rig_serial; /* which rig it was solved with; the latest description names it */
};

/* A person should read it; the station may end the connection behind it. */
struct stage_notice {
	int32_t kind; /* as in stage.proto: 1 refused, 2 protocol */
	const char *text;
};

struct stage_queue {
	uint32_t filled, filled_max, capacity; /* now, at most since the start, room for */
};

struct stage_count {
	const char *cause;
	uint64_t count; /* not 0 */
};

struct stage_camera_statistics {
	const char *state;
	uint64_t frames, missing; /* shots without this camera */
	struct stage_queue queue; /* to the solver */
	uint32_t loss_count, event_count;
	const struct stage_count *losses; /* by cause */
	const struct stage_count *events; /* of the pulse ledger */
	/* how far its picture seems off by what the other cameras see, and the turn that explains
	 * it (0: none fitted); 0 but for the camera that explains most */
	double moved_px, moved_mrad;
	uint64_t blobs_masked; /* spots that lay in its mask */
	uint64_t reopened;     /* times that it was lost and came back */
};

struct stage_percentiles {
	uint64_t count;
	int64_t p50_ns, p90_ns, p99_ns, max_ns;
};

struct stage_latency {
	const char *stage;
	struct stage_percentiles run;    /* since the start */
	struct stage_percentiles recent; /* of the last 10 to 20 s */
};

/* What the trigger's pulses were like. */
struct stage_pulses {
	bool lost;       /* the trigger is gone, and looked for */
	uint64_t missed; /* periods in which nothing was fired */
	uint64_t reopened;
	struct stage_percentiles late; /* how long after its time each was fired */
	uint32_t event_count;
	const struct stage_count *events; /* what went otherwise than planned */
};

/* A thread of the station that hangs: "trigger", "solver" or a camera's name. */
struct stage_stall {
	const char *thread;
	int64_t still_ns;
};

/* A good part of the layout is in view, and hardly any of it is recognised. Means of the last
 * quarter of a second. */
struct stage_unnamed {
	double seconds; /* for so long */
	double spots;   /* that cameras see in a picture */
	double points;  /* that are made of them in a shot, with a name or without */
	double named;   /* labels that are seen in a shot */
	const char *remedy;
};

/* Once a second: how the station does; counts since its start. */
struct stage_statistics {
	int64_t time_ns;
	const char *state;
	uint32_t run;
	uint64_t shots_solved, shots_incomplete, shots_lost, sim_late;
	double shots_per_s;
	struct stage_queue edges, sets; /* trigger to solver, solver to stream */
	uint32_t camera_count;          /* in the description's order */
	const struct stage_camera_statistics *cameras;
	uint32_t latency_count;
	const struct stage_latency *latencies;
	const struct stage_pulses *pulses; /* NULL where no trigger reports them */
	uint64_t edges_refused;            /* reports of pulses for which `edges` had no room */
	uint32_t stall_count;              /* 0 when all is well */
	const struct stage_stall *stalls;
	const struct stage_unnamed *unnamed; /* NULL while what the cameras see has names */
};

/* The pointer that belongs to `kind` is set, the others are NULL. The memory is the client's:
 * a description's until the next one comes, all else until the next stage_client_next(). */
struct stage_event {
	enum stage_event_kind kind;
	const struct stage_description *description;
	const struct stage_marker_set *markers;
	const struct stage_notice *notice;
	const struct stage_statistics *statistics;
};

struct stage_client;

/* Returns 0 or a negative errno: what connect() says, -ENAMETOOLONG or -ENOMEM. */
int stage_client_open(struct stage_client **out, const char *socket_path);
void stage_client_close(struct stage_client *client); /* accepts NULL */

/* For poll(): when it is readable, call stage_client_next(client, 0, ...) until it says -ETIMEDOUT.
 * It stays the client's. */
int stage_client_fd(const struct stage_client *client);

/* Waits up to `timeout_ms` (negative: for ever) for the next event. Returns 0, or
 *   -ETIMEDOUT  nothing came
 *   -EINTR      a signal came
 *   -ENODATA    the station ended the stream
 *   -EPROTO     what came is not a valid stream: close
 *   -ENOMEM, or what recv() says */
int stage_client_next(struct stage_client *client, int timeout_ms, struct stage_event *event);

/*
 * Where something was at `at_ns`, by where four marker sets in a row have it: on the cubic through
 * them (Lagrange). For HD pictures, which are exposed between two shots: `at_ns` is
 * hd_mid_exposure_ns of the second set. At 120 Hz a face that talks is met to some micrometres.
 * `times_ns` are the sets' mid_exposure_ns. Returns 0; -EDOM when two times are the same, a place
 * is not finite, or `at_ns` is before the first or behind the last.
 */
int stage_interpolate(const int64_t times_ns[4], const double p_m[4][3], int64_t at_ns,
		      double out_m[3]);

#ifdef __cplusplus
}
#endif
