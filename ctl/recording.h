/*
 * The recorded frames of a config's cameras as blob sets: a thread per camera reads and searches
 * ahead, the caller takes the oldest of each. What comes out does not depend on the threads.
 */
#pragma once

#include "config/stage.h"
#include "drivers/open_cameras.h"
#include "track/blobs/blobs.h"

struct recording;

struct recording_losses {
	uint64_t frames;     /* read whole */
	uint64_t damaged;    /* could not be read, or of another size: missing from their shots */
	uint64_t blobs_lost; /* found beyond what a set holds */
	int error;           /* negative errno that ended the reading early, or 0 */
};

/* Starts reading the open `cameras` (one per camera of the config; NULL ones are left out), at most
 * `thread_count` of them at once. Both are borrowed until recording_close(). */
int recording_open(struct recording **out, const struct stage *stage, struct open_camera *cameras,
		   uint32_t thread_count, struct diag *diag);
void recording_close(struct recording *recording); /* accepts NULL; ends the threads */

/* The oldest blob set of a camera, waiting for it; NULL when the camera's recording is over. */
const struct blob_set *recording_peek(struct recording *recording, uint32_t camera);
void recording_pop(struct recording *recording, uint32_t camera);

/* Whole only after every camera has ended. */
struct recording_losses recording_losses(const struct recording *recording, uint32_t camera);
