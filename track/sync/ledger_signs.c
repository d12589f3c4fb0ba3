/*
 * What neither counter nor time shows, and the pictures do.
 */
#include "track/sync/ledger_parts.h"

#include <stdlib.h>

#define OFF_SHOTS 0.6  /* off by most of a shot: out of step ... */
#define BACK_SHOTS 0.3 /* ... until it is within so much again */
#define DARK_BLOBS 2   /* that a dark camera may still see: lamps, the sun */
#define LIT_BLOBS 16
#define BRIGHT_REST 5 /* of a good camera's spots at most one in so many is saturated */
#define SIGN_SHOTS 12
#define LITTLE_SHARE 16 /* of a period: times scatter by less */
#define CLOCK_FRAMES 24 /* with one and the same jump, until it is the clock's */
#define STEADY_PX 0.06  /* off by less, a camera that had moved is back */

void ledger_note_late(struct ledger *ledger, uint32_t camera, uint64_t shot)
{
	ledger_note(&ledger->cameras[camera], LEDGER_LATE, shot, 1);
}

void ledger_note_step(struct ledger *ledger, uint32_t camera, uint64_t shot, double off_shots)
{
	struct ledger_camera *c = &ledger->cameras[camera];
	double off = off_shots < 0 ? -off_shots : off_shots;

	if (off >= OFF_SHOTS && !c->out_of_step)
		ledger_note(c, LEDGER_OUT_OF_STEP, shot, 1);
	if (off >= OFF_SHOTS || off < BACK_SHOTS)
		c->out_of_step = off >= OFF_SHOTS;
}

static bool is_dark(const struct ledger_blobs *blobs, const struct ledger_blobs *all)
{
	return blobs->count <= DARK_BLOBS && all->count >= 2;
}

static bool is_bright(const struct ledger_blobs *blobs)
{
	return blobs->count >= LIT_BLOBS && 2 * blobs->saturated >= blobs->count;
}

/* Counts a state's shots in a row, and names it once it has lasted. */
static bool lasts(struct ledger_camera *camera, uint32_t *run, bool holds, enum ledger_event event,
		  uint64_t shot)
{
	*run = holds ? *run + 1 : 0;
	if (*run == SIGN_SHOTS)
		ledger_note(camera, event, shot, 1);
	return *run >= SIGN_SHOTS;
}

void ledger_note_blobs(struct ledger *ledger, uint64_t shot, const struct ledger_blobs *blobs,
		       uint32_t camera_count)
{
	struct ledger_blobs lit = {0, 0}; /* cameras that see enough; those whose spots are good */

	for (uint32_t c = 0; c < camera_count; c++) {
		lit.count += blobs[c].count >= LIT_BLOBS;
		lit.saturated += blobs[c].count >= LIT_BLOBS &&
				 BRIGHT_REST * blobs[c].saturated <= blobs[c].count;
	}
	for (uint32_t c = 0; c < camera_count; c++) {
		struct ledger_camera *camera = &ledger->cameras[c];

		if (blobs[c].count < 0)
			continue;
		camera->dark = lasts(camera, &camera->dark_run, is_dark(&blobs[c], &lit),
				     LEDGER_DARK, shot);
		camera->overexposed =
			lasts(camera, &camera->overexposed_run,
			      is_bright(&blobs[c]) && lit.saturated >= 2, LEDGER_OVEREXPOSED, shot);
	}
}

static int64_t nearest_multiple(int64_t value, int64_t of)
{
	return (value + (value < 0 ? -of : of) / 2) / of * of;
}

bool ledger_note_clock(struct ledger *ledger, uint32_t camera, uint64_t shot, int64_t off_ns)
{
	struct ledger_camera *c = &ledger->cameras[camera];
	int64_t period_ns = ledger->edges.period_ns, little_ns = period_ns / LITTLE_SHARE;

	/* whole periods are stamps of another shot: each is named when it is put right */
	if (llabs(off_ns - nearest_multiple(off_ns, period_ns)) <= little_ns) {
		c->clock_run = 0;
		return true;
	}
	bool same = c->clock_run && llabs(off_ns - c->clock_seen_ns) <= little_ns;

	c->clock_seen_ns = off_ns;
	c->clock_run = same ? c->clock_run + 1 : 1;
	if (c->clock_run < CLOCK_FRAMES)
		return false;
	c->clock_off_ns += off_ns;
	c->clock_run = 0;
	ledger_note(c, LEDGER_CLOCK_STEPPED, shot, 1);
	return false;
}

void ledger_note_aim(struct ledger *ledger, uint32_t camera, uint64_t shot, double shift_px,
		     double turn_mrad)
{
	struct ledger_camera *c = &ledger->cameras[camera];

	if (c->out_of_step) /* which explains it better */
		return;
	c->moved_px = shift_px;
	c->moved_mrad = turn_mrad;
	if (shift_px >= LEDGER_MOVED_PX && !c->moved)
		ledger_note(c, LEDGER_MOVED, shot, 1);
	if (shift_px >= LEDGER_MOVED_PX || shift_px < STEADY_PX)
		c->moved = shift_px >= LEDGER_MOVED_PX;
}
