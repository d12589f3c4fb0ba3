/*
 * The prompts.
 */
#include "calib/actor/actor_script.h"

#include <string.h>

const struct actor_prompt ACTOR_PROMPTS[ACTOR_POSE_COUNT] = {
	{"jaw", "open the mouth"},
	{"jaw_wide", "open the mouth as wide as you can"},
	{"jaw_left", "move the jaw to your left"},
	{"jaw_right", "move the jaw to your right"},
	{"jaw_forward", "push the jaw forward"},
	{"jaw_back", "pull the jaw back"},
	{"chew", "chew, the jaw to one side"},
	{"yawn", "yawn"},
	{"smile", "smile, lips closed"},
	{"smile_left", "smile on your left side alone"},
	{"smile_right", "smile on your right side alone"},
	{"grin", "grin and show the teeth"},
	{"laugh", "laugh with an open mouth"},
	{"joy", "smile with the eyes too"},
	{"contempt", "contempt: one corner of the mouth up"},
	{"stretch", "draw the mouth wide, without a smile"},
	{"grimace", "draw the mouth wide and show all teeth"},
	{"pucker", "purse the lips"},
	{"kiss", "kiss"},
	{"whistle", "whistle"},
	{"funnel", "make a funnel of the lips"},
	{"lip_drop", "lower the lower lip: show the lower teeth"},
	{"lip_raise", "raise the upper lip: show the upper teeth"},
	{"lip_press", "press the lips together"},
	{"lip_roll", "roll the lips in"},
	{"corners_down", "pull the corners of the mouth down"},
	{"pout", "pout"},
	{"puff", "blow up the cheeks"},
	{"suck", "suck the cheeks in"},
	{"chin_raise", "push the chin up"},
	{"snarl", "wrinkle the nose"},
	{"snarl_left", "wrinkle the nose on your left side"},
	{"snarl_right", "wrinkle the nose on your right side"},
	{"disgust", "disgust"},
	{"blink", "close the eyes"},
	{"wink_left", "wink with your left eye"},
	{"wink_right", "wink with your right eye"},
	{"squint", "screw up the eyes"},
	{"brows", "raise the eyebrows"},
	{"brow_left", "raise your left eyebrow"},
	{"brow_right", "raise your right eyebrow"},
	{"frown", "frown"},
	{"anger", "anger"},
	{"fear", "fear"},
	{"surprise", "surprise"},
	{"sadness", "sadness"},
	{"phoneme_aa", "say AA, as in father"},
	{"phoneme_ae", "say AE, as in cat"},
	{"phoneme_ah", "say AH, as in cut"},
	{"phoneme_ao", "say AO, as in law"},
	{"phoneme_eh", "say EH, as in bed"},
	{"phoneme_er", "say ER, as in bird"},
	{"phoneme_ih", "say IH, as in sit"},
	{"phoneme_iy", "say IY, as in see"},
	{"phoneme_ow", "say OW, as in go"},
	{"phoneme_uw", "say UW, as in too"},
	{"phoneme_m", "say M, as in mum"},
	{"phoneme_f", "say F, as in fun"},
	{"phoneme_th", "say TH, as in thin"},
	{"phoneme_s", "say S, as in sun"},
	{"phoneme_sh", "say SH, as in shoe"},
	{"phoneme_l", "say L, as in long"},
	{"phoneme_w", "say W, as in we"},
	{"phoneme_k", "say K, as in key"},
};

int actor_prompt_find(const char *name)
{
	for (int i = 0; i < ACTOR_POSE_COUNT; i++)
		if (strcmp(ACTOR_PROMPTS[i].name, name) == 0)
			return i;
	return -1;
}
