/*
 * Speech is a syllable rhythm of the jaw, with a mouth that moves from phoneme to phoneme; every
 * few seconds the speaker pauses and does something else.
 */
#include "sim/face/performance.h"

#include <string.h>

#include "sim/face/ease.h"

#define PHONEME_S 0.25
#define PAUSE_SLOT_S 8.0
#define PAUSE_S 1.8
#define BLINK_SLOT_S 3.0
#define TRIAL_S 30.0 /* in which the peak speed is looked for */
#define TRIAL_STEP_S 0.02
#define TRIAL_MARKERS 16
#define CALM_SPEED_M_S 0.3 /* below this, everything is done less */

/* What is done in a pause; lips are pressed in two of five. */
static const char *const ACTIONS[PERFORMANCE_ACTIONS] = {"lip_press", "smile", "lip_press", "puff",
							 "frown"};

static const struct band SYLLABLES = {3.1, 3.8}, MIMIC = {0.4, 2.0};

/* One sine leads, so that the peak speed comes every few seconds. */
static const double JAW_AMPLITUDE[SIGNAL_SINES] = {0.15, 0.2, 0.65};

enum dice { DICE_PHONEME, DICE_PAUSE, DICE_ACTION, DICE_BLINK, DICE_BLINK_S, DICE_COUNT };

static double dice(const struct performance *p, enum dice kind, int64_t slot)
{
	return signal_dice(p->dice, (uint64_t)slot * DICE_COUNT + (uint64_t)kind);
}

/* Neutral at the take's ends, when asked for; a take that is played on starts again. */
static double take_gate(const struct performance *p, double time_s)
{
	double gate = 1;

	if (p->neutral_start_s > 0)
		gate = ease((time_s - p->neutral_start_s) / EASE_RISE_S);
	if (p->neutral_end_s > 0 && time_s < p->seconds + EASE_RISE_S)
		gate *= 1 - swell(time_s, p->seconds - p->neutral_end_s - EASE_RISE_S,
				  p->seconds + EASE_RISE_S, EASE_RISE_S);
	return gate;
}

static void add_phonemes(const struct performance *p, double time_s, double gain,
			 double weights[BASIS_COUNT])
{
	int64_t now = (int64_t)floor(time_s / PHONEME_S);

	for (int64_t slot = now - 2; slot <= now; slot++) {
		double start_s = (double)slot * PHONEME_S;
		double share = ease((time_s - start_s) / EASE_RISE_S) -
			       ease((time_s - start_s - PHONEME_S) / EASE_RISE_S);
		int phoneme = (int)(dice(p, DICE_PHONEME, slot) * FACE_PHONEME_COUNT);

		face_pose_add(FACE_PHONEME_FIRST + phoneme, gain * share, weights);
	}
}

/* How much of a pause there is now; what is done in it goes into the weights. */
static double add_pause(const struct performance *p, double time_s, double gain,
			double weights[BASIS_COUNT])
{
	int64_t slot = (int64_t)floor(time_s / PAUSE_SLOT_S);
	double start_s = ((double)slot + 0.7 * dice(p, DICE_PAUSE, slot)) * PAUSE_SLOT_S;
	double quiet = swell(time_s, start_s, start_s + PAUSE_S, EASE_RISE_S);
	int action = (int)(dice(p, DICE_ACTION, slot) * PERFORMANCE_ACTIONS);

	if (quiet > 0)
		face_pose_add(
			p->actions[action],
			gain * swell(time_s, start_s + 0.3, start_s + PAUSE_S - 0.1, EASE_RISE_S),
			weights);
	return quiet;
}

static void add_blink(const struct performance *p, double time_s, double gain,
		      double weights[BASIS_COUNT])
{
	int64_t slot = (int64_t)floor(time_s / BLINK_SLOT_S);
	double middle_s = ((double)slot + 0.1 + 0.8 * dice(p, DICE_BLINK, slot)) * BLINK_SLOT_S;
	double width_s = 0.3 + 0.1 * dice(p, DICE_BLINK_S, slot);
	double closed = gain * bump(time_s, middle_s, width_s);

	weights[BASIS_BLINK_L] += closed;
	weights[BASIS_BLINK_R] += closed;
}

static double half(const struct signal *signal, double time_s)
{
	return 0.5 + 0.5 * signal_at(signal, time_s);
}

static void add_speech(const struct performance *p, double time_s, double weights[BASIS_COUNT])
{
	double gate = take_gate(p, time_s), shape = gate * p->shape_gain;
	double loud = 1 - add_pause(p, time_s, shape, weights);

	add_phonemes(p, time_s, shape * loud, weights);
	weights[BASIS_JAW_OPEN] += gate * loud * p->jaw_gain * half(&p->jaw, time_s);
	weights[BASIS_JAW_SIDE] += 0.15 * shape * loud * signal_at(&p->jaw_side, time_s);
	weights[BASIS_SMILE_L] += 0.5 * shape * loud * half(&p->smile, time_s);
	weights[BASIS_SMILE_R] += 0.5 * shape * loud * half(&p->smile, time_s);
	weights[BASIS_SNARL_L] += 0.3 * shape * loud * half(&p->snarl, time_s);
	weights[BASIS_SNARL_R] += 0.3 * shape * loud * half(&p->snarl, time_s);
	weights[BASIS_BROW_L] += 0.7 * shape * half(&p->brow[0], time_s);
	weights[BASIS_BROW_R] += 0.7 * shape * half(&p->brow[1], time_s);
	weights[BASIS_FROWN] += 0.5 * shape * half(&p->frown, time_s);
	add_blink(p, time_s, gate, weights);
}

/* Pose after pose, each from neutral and back to it. */
static void add_range(const struct performance *p, double time_s, double weights[BASIS_COUNT])
{
	double since_s = time_s - p->neutral_start_s;
	double at_s = fmod(since_s, PERFORMANCE_POSE_S);

	if (since_s < 0)
		return;
	face_pose_add((int)fmod(floor(since_s / PERFORMANCE_POSE_S), FACE_POSE_COUNT),
		      swell(at_s, 0.1, PERFORMANCE_POSE_S - 0.3, EASE_RISE_S), weights);
}

void performance_weights(const struct performance *p, double time_s, double weights[BASIS_COUNT])
{
	memset(weights, 0, BASIS_COUNT * sizeof(*weights));
	if (p->kind == SIM_RANGE_OF_MOTION)
		add_range(p, time_s, weights);
	else if (p->kind != SIM_STILL)
		add_speech(p, time_s, weights);
}

/* The markers that the jaw moves most: one of them is the fastest. */
static int pick_fast(const struct face *face, uint32_t picked[TRIAL_MARKERS])
{
	int count = 0;

	for (uint32_t m = 0; m < face->marker_count; m++) {
		double reach = vec3_norm(face->markers[m].shift_m[BASIS_JAW_OPEN]);
		int at = count < TRIAL_MARKERS ? count++ : TRIAL_MARKERS;

		for (; at > 0; at--) {
			uint32_t other = picked[at - 1];

			if (vec3_norm(face->markers[other].shift_m[BASIS_JAW_OPEN]) >= reach)
				break;
			if (at < TRIAL_MARKERS)
				picked[at] = other;
		}
		if (at < TRIAL_MARKERS)
			picked[at] = m;
	}
	return count;
}

static double peak_speed_m_s(const struct performance *p, const struct face *face)
{
	const double step_s = 1e-3;
	uint32_t picked[TRIAL_MARKERS];
	int count = pick_fast(face, picked);
	double before[BASIS_COUNT], after[BASIS_COUNT], top_m_s = 0;
	struct vec3 normal;

	for (double t = 0; t < TRIAL_S; t += TRIAL_STEP_S) {
		performance_weights(p, t, before);
		performance_weights(p, t + step_s, after);
		for (int i = 0; i < count; i++)
			top_m_s = fmax(
				top_m_s,
				vec3_distance(face_marker_place(face, picked[i], before, &normal),
					      face_marker_place(face, picked[i], after, &normal)) /
					step_s);
	}
	return top_m_s;
}

/* Secant steps on the jaw, beside which the rest adds little. */
static void set_speed(struct performance *p, const struct face *face, double speed_m_s)
{
	double gain = speed_m_s / 0.2, last_gain = 0, last_m_s;

	p->shape_gain = fmin(1, speed_m_s / CALM_SPEED_M_S);
	p->jaw_gain = 0;
	last_m_s = peak_speed_m_s(p, face);
	if (face->marker_count == 0 || speed_m_s <= 0)
		return;
	for (int pass = 0; pass < 5; pass++) {
		p->jaw_gain = gain;
		double m_s = peak_speed_m_s(p, face);
		double slope = (m_s - last_m_s) / (gain - last_gain);

		if (fabs(m_s - speed_m_s) < 0.005 * speed_m_s || !(slope > 0))
			return;
		last_gain = gain;
		last_m_s = m_s;
		gain = fmax(gain + (speed_m_s - m_s) / slope, 0);
	}
}

void performance_init(struct performance *p, const struct sim_actor_script *script,
		      const struct face *face, double seconds, uint64_t seed)
{
	struct rng rng;

	rng_init(&rng, seed, 6);
	*p = (struct performance){.kind = script->performance,
				  .dice = seed,
				  .seconds = seconds,
				  .neutral_start_s = script->neutral_start_s,
				  .neutral_end_s = script->neutral_end_s};
	for (int i = 0; i < PERFORMANCE_ACTIONS; i++)
		p->actions[i] = face_pose_find(ACTIONS[i]);
	p->jaw = signal_make(&rng, SYLLABLES);
	memcpy(p->jaw.amplitude, JAW_AMPLITUDE, sizeof(JAW_AMPLITUDE));
	p->jaw_side = signal_make(&rng, MIMIC);
	p->smile = signal_make(&rng, MIMIC);
	p->snarl = signal_make(&rng, MIMIC);
	p->brow[0] = signal_make(&rng, MIMIC);
	p->brow[1] = signal_make(&rng, MIMIC);
	p->frown = signal_make(&rng, MIMIC);
	if (p->kind != SIM_STILL && p->kind != SIM_RANGE_OF_MOTION)
		set_speed(p, face, script->face_speed_m_s);
}
