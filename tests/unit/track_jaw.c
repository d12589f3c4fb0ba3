/*
 * A mouth that is open in the first shot, of a jaw that differs by 8 mm from what is thought, and
 * four lights where its markers would be if it were shut.
 */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>

#include <cmocka.h>

#include "one_face.h"
#include "track/label/jaw.h"

#define OPEN_RAD 0.3
#define DIFFERS_M 0.008
#define PITCH_M 0.007

enum { ACROSS = 5, ROWS = 6, LABELS = ACROSS * ROWS, CHIN = 2 * ACROSS, LIGHTS = 4 };

static void wear_mouth(void)
{
	struct layout_marker markers[LABELS] = {0};

	for (int i = 0; i < LABELS; i++) {
		int row = i / ACROSS;

		strcpy(markers[i].group, row == 0 ? "lip_upper" : row == 1 ? "lip_lower" : "chin");
		markers[i].neutral_m = (struct vec3){PITCH_M * (i % ACROSS - 2),
						     -0.050 - PITCH_M * row, 0.09 - 0.003 * row};
	}
	wear(markers, LABELS);
}

static void open_mouth(void)
{
	struct point points[LABELS + LIGHTS] = {0};

	for (int i = 0; i < LABELS + LIGHTS; i++) {
		const struct label_state *label = &state.labels[i];

		points[i].claimed_mask = 7;
		if (i >= LABELS) {
			points[i].fix.p_stage_m = state.labels[CHIN + 6 * (i - LABELS)].base_m;
			continue;
		}
		points[i].fix.p_stage_m =
			vec3_add(label->base_m, vec3_scale(label->jaw_m_rad, OPEN_RAD));
		points[i].fix.p_stage_m.z -= label->jaw_m_rad.y != 0 ? DIFFERS_M : 0;
	}
	nearby_build(&l.nearby, points, LABELS + LIGHTS, NULL);
}

static void an_open_mouth_is_found_though_jaws_differ(void **test_state)
{
	(void)test_state;
	wear_mouth();
	open_mouth();
	jaw_lean(&state, &l);
	for (int i = CHIN; i < LABELS; i++)
		assert_true(vec3_norm(state.labels[i].lean_m) >
			    0.8 * OPEN_RAD * vec3_norm(state.labels[i].jaw_m_rad));
}

int main(void)
{
	const struct CMUnitTest tests[] = {
		cmocka_unit_test(an_open_mouth_is_found_though_jaws_differ),
	};

	cmocka_set_message_output(CM_OUTPUT_TAP);
	return cmocka_run_group_tests(tests, NULL, NULL);
}
