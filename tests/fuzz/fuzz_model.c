/*
 * Any bytes as a camera model: what passes our check, libmrcal must survive.
 */
#include <assert.h>
#include <mrcal/mrcal.h>
#include <stdlib.h>
#include <string.h>

#include "config/model_text.h"
#include "tests/fuzz/fuzz_target.h"

static void use_model(const char *text, size_t size)
{
	mrcal_cameramodel_t *model = mrcal_read_cameramodel_string(text, (int)size);

	for (int i = 0; model && i < 9; i++) {
		mrcal_point2_t q = {.x = model->imagersize[0] * (i % 3) / 2.0,
				    .y = model->imagersize[1] * (i / 3) / 2.0};
		mrcal_point3_t v;

		if (mrcal_unproject(&v, &q, 1, &model->lensmodel, model->intrinsics))
			mrcal_project(&q, NULL, NULL, &v, 1, &model->lensmodel, model->intrinsics);
	}
	mrcal_free_cameramodel(&model);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct diag diag = {0};
	char *text = malloc(size + 1);

	if (!text)
		abort();
	memcpy(text, data, size);
	text[size] = '\0';
	int err = model_text_check(text, size, "m", &diag);
	assert((err == 0) == (diag.count == 0));
	if (!err)
		use_model(text, size);
	diag_finish(&diag);
	free(text);
	return 0;
}
