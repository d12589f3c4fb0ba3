/*
 * Views that agree by chance or by halves of spots make points that no marker is at.
 */
#include "track/match/point_views.h"

#include <stddef.h>

#define UNRESOLVED_PX 0.5f /* the sigma of a spot of two; parts of one know their place better */
#define STRAINED_CHI2 9.0  /* per degree of freedom: three sigmas */
#define TELLS_PX 0.8       /* a view that is less sure confirms nothing */

static const struct blob *blob_of(const struct matcher *m, const struct point *point, uint32_t c)
{
	return &m->cameras[c].blobs[point->blob[c]];
}

bool point_is_merged(const struct matcher *m, const struct point *point)
{
	int count = 0;

	for (uint32_t left = point->fix.used_mask; left; left &= left - 1) {
		const struct blob *blob = blob_of(m, point, (uint32_t)__builtin_ctz(left));

		count += blob->flags & BLOB_MERGED && blob->sigma_px > UNRESOLVED_PX;
	}
	return 2 * count > point->fix.used_count;
}

bool point_is_unsure(const struct matcher *m, const struct point *point)
{
	int sure = match_sure_views(m, point);

	if (sure >= 3 || sure == point->fix.used_count)
		return false;
	for (uint32_t left = point->fix.used_mask; left; left &= left - 1)
		if (!(blob_of(m, point, (uint32_t)__builtin_ctz(left))->flags & BLOB_MERGED))
			return false;
	return true;
}

bool point_is_strained(const struct matcher *m, const struct point *point)
{
	int count = 0, plain_count = 0;

	for (uint32_t left = point->fix.used_mask; left; left &= left - 1) {
		uint32_t c = (uint32_t)__builtin_ctz(left);

		count += blob_of(m, point, c)->sigma_px < TELLS_PX;
		plain_count += !match_is_half(m, c, point->blob[c], NULL);
	}
	return count < 3 || plain_count == 0 || point->fix.chi2_per_dof > STRAINED_CHI2;
}
