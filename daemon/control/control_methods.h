/*
 * What the control socket can be asked. Requests and replies are JSON; control.c carries them.
 */
#pragma once

#include <jansson.h>
#include <stdbool.h>

#include "daemon/control/control.h"
#include "daemon/control/varlink.h"

struct control_context {
	struct station *station;
	const struct server *server; /* NULL until it listens */
	const struct control_stats *stats;
};

/* What a client waits for, when its reply is not there at once. */
enum wait_kind {
	WAIT_NONE,
	WAIT_PREVIEW, /* preview_reply() once the camera's image is there */
	WAIT_SHOT,    /* observe_reply() once a shot was copied */
	WAIT_RIG,     /* rig_reply() once it is swapped, or that failed */
	WAIT_STATUS,  /* status_reply() every second, until the client goes */
	WAIT_HOLD,    /* calibrated_reply() once that is over; it is over when the client goes */
};

struct wait {
	enum wait_kind kind;
	int camera;   /* of WAIT_PREVIEW */
	uint32_t run; /* of WAIT_HOLD */
};

/* A request on its way through the methods. */
struct call {
	const struct control_context *context;
	const char *method;
	const json_t *parameters; /* an object, or NULL */
	bool more;                /* the client takes several replies */
	struct wait *wait;
	int *fd; /* goes with the reply; the station's */
};

/* The reply to a request, new; or NULL: then `*wait` says what for. A first reply may come with a
 * wait for more. `*fd` is untouched unless a descriptor goes with the reply. Never fails: an error
 * is a reply too. */
json_t *control_call(const struct control_context *context, enum permission permission,
		     const json_t *request, struct wait *wait, int *fd);

/* The methods that have a file of their own. */
json_t *control_preview(struct call *call);
json_t *control_observe(struct call *call);
json_t *control_reload_rig(struct call *call);
json_t *control_set_mask(struct call *call);

/* Of the station, by the parameter `camera`; or NULL, and *refusal (new) is the reply. */
struct capture *named_camera(const struct call *call, json_t **refusal);

json_t *too_many(int most);
json_t *wrong_state(const struct call *call);
json_t *failed_reply(enum exit_code code, const struct diag *diag);

/* The reply as text, the caller's; NULL without memory. `ready`: the camera's preview slot, or its
 * pool, holds an image; else the reply says that none came. */
char *preview_reply(struct station *station, int camera, bool ready);

/* The shot that was copied; not `ready`: that none came. */
json_t *observe_reply(const struct station *station, bool ready);

/* To ReloadRig, when `state` is DONE or FAILED. */
json_t *rig_reply(const struct station *station, enum rig_swap_state state);

/* The last reply to Calibrate with `more`; NULL while `run` still calibrates. */
json_t *calibrated_reply(const struct station *station, uint32_t run);

/* The client that calibrated is gone: so is what it did. */
void calibrated_by_nobody(struct station *station, uint32_t run);

/* The station as GetStatus returns it (status.c). */
json_t *station_status_json(const struct control_context *context);

/* GetStatus's reply; `more`: another one follows. */
json_t *status_reply(const struct control_context *context, bool more);
