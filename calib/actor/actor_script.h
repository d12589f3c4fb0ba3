/*
 * What an actor is asked to do for his calibration: 64 poses, the last 18 of them phonemes, each
 * from rest and back to it.
 */
#pragma once

#define ACTOR_POSE_COUNT 64
#define ACTOR_PHONEME_COUNT 18

struct actor_prompt {
	const char *name; /* in files; as the simulator names it */
	const char *text; /* what the operator reads out */
};

extern const struct actor_prompt ACTOR_PROMPTS[ACTOR_POSE_COUNT];

int actor_prompt_find(const char *name); /* -1 when there is none */
