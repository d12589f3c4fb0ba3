/*
 * The 64 named poses.
 */
#include <string.h>

#include "sim/face/face_basis.h"

#define JAW(w)                    \
	{                         \
		BASIS_JAW_OPEN, w \
	}
#define JAW_SIDE(w)               \
	{                         \
		BASIS_JAW_SIDE, w \
	}
#define JAW_FORWARD(w)               \
	{                            \
		BASIS_JAW_FORWARD, w \
	}
#define SMILE_L(w)               \
	{                        \
		BASIS_SMILE_L, w \
	}
#define SMILE_R(w)               \
	{                        \
		BASIS_SMILE_R, w \
	}
#define SMILE(w) SMILE_L(w), SMILE_R(w)
#define STRETCH(w)               \
	{                        \
		BASIS_STRETCH, w \
	}
#define PUCKER(w)               \
	{                       \
		BASIS_PUCKER, w \
	}
#define FUNNEL(w)               \
	{                       \
		BASIS_FUNNEL, w \
	}
#define LIP_DROP(w)               \
	{                         \
		BASIS_LIP_DROP, w \
	}
#define LIP_RAISE(w)               \
	{                          \
		BASIS_LIP_RAISE, w \
	}
#define LIP_PRESS(w)               \
	{                          \
		BASIS_LIP_PRESS, w \
	}
#define CORNERS_DOWN(w)               \
	{                             \
		BASIS_CORNERS_DOWN, w \
	}
#define PUFF(w)               \
	{                     \
		BASIS_PUFF, w \
	}
#define CHIN_RAISE(w)               \
	{                           \
		BASIS_CHIN_RAISE, w \
	}
#define SNARL_L(w)               \
	{                        \
		BASIS_SNARL_L, w \
	}
#define SNARL_R(w)               \
	{                        \
		BASIS_SNARL_R, w \
	}
#define SNARL(w) SNARL_L(w), SNARL_R(w)
#define BLINK_L(w)               \
	{                        \
		BASIS_BLINK_L, w \
	}
#define BLINK_R(w)               \
	{                        \
		BASIS_BLINK_R, w \
	}
#define BLINK(w) BLINK_L(w), BLINK_R(w)
#define SQUINT(w)               \
	{                       \
		BASIS_SQUINT, w \
	}
#define BROW_L(w)               \
	{                       \
		BASIS_BROW_L, w \
	}
#define BROW_R(w)               \
	{                       \
		BASIS_BROW_R, w \
	}
#define BROWS(w) BROW_L(w), BROW_R(w)
#define FROWN(w)               \
	{                      \
		BASIS_FROWN, w \
	}

const struct face_pose FACE_POSES[FACE_POSE_COUNT] = {
	{"jaw", {JAW(1)}},
	{"jaw_wide", {JAW(1.6)}},
	{"jaw_left", {JAW_SIDE(1), JAW(0.2)}},
	{"jaw_right", {JAW_SIDE(-1), JAW(0.2)}},
	{"jaw_forward", {JAW_FORWARD(1)}},
	{"jaw_back", {JAW_FORWARD(-0.6)}},
	{"chew", {JAW(0.4), JAW_SIDE(0.6)}},
	{"yawn", {JAW(1.8), BLINK(0.6), SQUINT(0.7)}},
	{"smile", {SMILE(1)}},
	{"smile_left", {SMILE_L(1)}},
	{"smile_right", {SMILE_R(1)}},
	{"grin", {SMILE(0.9), LIP_RAISE(0.6), LIP_DROP(0.5)}},
	{"laugh", {SMILE(1), JAW(0.7), SQUINT(0.7)}},
	{"joy", {SMILE(0.9), SQUINT(0.6)}},
	{"contempt", {SMILE_L(0.5), CHIN_RAISE(0.4)}},
	{"stretch", {STRETCH(1)}},
	{"grimace", {STRETCH(1), LIP_DROP(0.7), LIP_RAISE(0.5)}},
	{"pucker", {PUCKER(1)}},
	{"kiss", {PUCKER(1), LIP_PRESS(0.5)}},
	{"whistle", {PUCKER(1), FUNNEL(0.4), JAW(0.15)}},
	{"funnel", {FUNNEL(1), JAW(0.3)}},
	{"lip_drop", {LIP_DROP(1)}},
	{"lip_raise", {LIP_RAISE(1)}},
	{"lip_press", {LIP_PRESS(1)}},
	{"lip_roll", {LIP_PRESS(0.7), CHIN_RAISE(0.3)}},
	{"corners_down", {CORNERS_DOWN(1)}},
	{"pout", {CHIN_RAISE(0.8), FUNNEL(0.5)}},
	{"puff", {PUFF(1)}},
	{"suck", {PUFF(-0.7), PUCKER(0.3)}},
	{"chin_raise", {CHIN_RAISE(1)}},
	{"snarl", {SNARL(1)}},
	{"snarl_left", {SNARL_L(1)}},
	{"snarl_right", {SNARL_R(1)}},
	{"disgust", {SNARL(0.9), LIP_RAISE(0.5), SQUINT(0.6)}},
	{"blink", {BLINK(1)}},
	{"wink_left", {BLINK_L(1), SMILE_L(0.4)}},
	{"wink_right", {BLINK_R(1), SMILE_R(0.4)}},
	{"squint", {SQUINT(1)}},
	{"brows", {BROWS(1)}},
	{"brow_left", {BROW_L(1)}},
	{"brow_right", {BROW_R(1)}},
	{"frown", {FROWN(1)}},
	{"anger", {FROWN(1), SNARL(0.5), LIP_PRESS(0.7)}},
	{"fear", {BROWS(0.8), FROWN(0.4), STRETCH(0.8), JAW(0.3)}},
	{"surprise", {BROWS(1), JAW(0.9), BLINK(-0.3)}},
	{"sadness", {FROWN(0.5), CORNERS_DOWN(0.9), BROWS(0.3)}},
	{"phoneme_aa", {JAW(0.9), LIP_DROP(0.3)}},
	{"phoneme_ae", {JAW(0.7), STRETCH(0.5)}},
	{"phoneme_ah", {JAW(0.5)}},
	{"phoneme_ao", {JAW(0.6), FUNNEL(0.6)}},
	{"phoneme_eh", {JAW(0.4), STRETCH(0.3), LIP_DROP(0.3)}},
	{"phoneme_er", {JAW(0.2), FUNNEL(0.3), LIP_DROP(0.2)}},
	{"phoneme_ih", {JAW(0.25), STRETCH(0.4), LIP_DROP(0.4)}},
	{"phoneme_iy", {STRETCH(0.9), LIP_DROP(0.5), JAW(0.1)}},
	{"phoneme_ow", {JAW(0.4), PUCKER(0.6), FUNNEL(0.3)}},
	{"phoneme_uw", {PUCKER(1), JAW(0.1)}},
	{"phoneme_m", {LIP_PRESS(1)}},
	{"phoneme_f", {LIP_RAISE(0.4), JAW_FORWARD(-0.4), JAW(0.1)}},
	{"phoneme_th", {JAW(0.2), LIP_DROP(0.5)}},
	{"phoneme_s", {STRETCH(0.5), LIP_DROP(0.6), LIP_RAISE(0.2)}},
	{"phoneme_sh", {FUNNEL(0.9), LIP_RAISE(0.2)}},
	{"phoneme_l", {JAW(0.35), LIP_DROP(0.2)}},
	{"phoneme_w", {PUCKER(1), LIP_PRESS(0.3)}},
	{"phoneme_k", {JAW(0.3), STRETCH(0.2)}},
};

int face_pose_find(const char *name)
{
	for (int i = 0; i < FACE_POSE_COUNT; i++)
		if (strcmp(FACE_POSES[i].name, name) == 0)
			return i;
	return -1;
}

void face_pose_add(int pose, double scale, double weights[BASIS_COUNT])
{
	const struct face_pose *p = &FACE_POSES[pose];

	for (int i = 0; i < FACE_POSE_TERMS && p->terms[i].weight != 0; i++)
		weights[p->terms[i].basis] += scale * p->terms[i].weight;
}
