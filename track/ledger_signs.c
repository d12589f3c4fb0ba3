/*
 * What neither counter nor time shows, and the pictures do.
 */
#include "track/ledger.h"

#define OFF_SHOTS 0.6  /* off by most of a shot: out of step ... */
#define BACK_SHOTS 0.3 /* ... until it is within so much again */
#define DARK_BLOBS 2   /* that a dark camera may still see: lamps, the sun */
#define LIT_BLOBS 16
#define DARK_SHOTS 12

static void sign(struct ledger_camera *camera, enum ledger_event event, uint64_t shot)
{
	camera->counts[event]++;
	camera->event = event;
	camera->event_shot = shot;
}

void ledger_note_step(struct ledger *ledger, uint32_t camera, uint64_t shot, double off_shots)
{
	struct ledger_camera *c = &ledger->cameras[camera];
	double off = off_shots < 0 ? -off_shots : off_shots;

	if (off >= OFF_SHOTS && !c->out_of_step)
		sign(c, LEDGER_OUT_OF_STEP, shot);
	if (off >= OFF_SHOTS || off < BACK_SHOTS)
		c->out_of_step = off >= OFF_SHOTS;
}

void ledger_note_blobs(struct ledger *ledger, uint64_t shot, const int32_t *blob_counts,
		       uint32_t camera_count)
{
	uint32_t lit = 0;

	for (uint32_t c = 0; c < camera_count; c++)
		lit += blob_counts[c] >= LIT_BLOBS;
	for (uint32_t c = 0; c < camera_count; c++) {
		struct ledger_camera *camera = &ledger->cameras[c];

		if (blob_counts[c] < 0)
			continue;
		camera->dark_run =
			blob_counts[c] <= DARK_BLOBS && lit >= 2 ? camera->dark_run + 1 : 0;
		if (camera->dark_run == DARK_SHOTS)
			sign(camera, LEDGER_DARK, shot);
		camera->dark = camera->dark_run >= DARK_SHOTS;
	}
}
