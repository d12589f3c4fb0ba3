/*
 * The head's surface is an ellipsoid with bumps added along the radius; a place on it is named by
 * its azimuth (towards the subject's left) and elevation as seen from the head's middle.
 */
#include "sim/face.h"

#include <stdio.h>
#include <string.h>

#include "base/rng.h"
#include "sim/face_tables.h"

#define MM 1e-3
#define RAD (M_PI / 180.0)

#define JAW_ANGLE_RAD (8.8 * RAD) /* wide open: about 18 mm at the chin */
static const struct vec3 JAW_HINGE_M = {0, -12 * MM, 8 * MM};

/* Set by the seed. */
struct shape {
	struct vec3 axes_m;
	double relief_scale[FACE_RELIEF_COUNT];
};

static double lobe(double azimuth, double elevation, double centre_azimuth, double centre_elevation,
		   double sigma_azimuth, double sigma_elevation)
{
	double a = (azimuth - centre_azimuth) / sigma_azimuth;
	double e = (elevation - centre_elevation) / sigma_elevation;

	return exp(-0.5 * (a * a + e * e));
}

static double radius_m(const struct shape *shape, struct vec3 direction, double azimuth,
		       double elevation)
{
	struct vec3 d = {direction.x / shape->axes_m.x, direction.y / shape->axes_m.y,
			 direction.z / shape->axes_m.z};
	double radius = 1.0 / vec3_norm(d);

	for (int i = 0; i < FACE_RELIEF_COUNT; i++) {
		const struct face_relief *r = &FACE_RELIEF[i];
		double sum = lobe(azimuth, elevation, r->azimuth_deg, r->elevation_deg,
				  r->sigma_azimuth_deg, r->sigma_elevation_deg);

		if (r->azimuth_deg > 0)
			sum += lobe(azimuth, elevation, -r->azimuth_deg, r->elevation_deg,
				    r->sigma_azimuth_deg, r->sigma_elevation_deg);
		radius += shape->relief_scale[i] * r->height_mm * MM * sum;
	}
	return radius;
}

static struct vec3 surface_point(const struct shape *shape, double azimuth_deg,
				 double elevation_deg)
{
	double a = azimuth_deg * RAD, e = elevation_deg * RAD;
	struct vec3 direction = {sin(a) * cos(e), sin(e), cos(a) * cos(e)};

	return vec3_scale(direction, radius_m(shape, direction, azimuth_deg, elevation_deg));
}

static struct vec3 surface_normal(const struct shape *shape, double azimuth_deg,
				  double elevation_deg)
{
	double step_deg = 0.05;
	struct vec3 across = vec3_sub(surface_point(shape, azimuth_deg + step_deg, elevation_deg),
				      surface_point(shape, azimuth_deg - step_deg, elevation_deg));
	struct vec3 up = vec3_sub(surface_point(shape, azimuth_deg, elevation_deg + step_deg),
				  surface_point(shape, azimuth_deg, elevation_deg - step_deg));

	return vec3_unit(vec3_cross(across, up));
}

static double spread(struct rng *rng, double half_width)
{
	return half_width * (2.0 * rng_uniform(rng) - 1.0);
}

static struct shape shape_of(struct rng *rng)
{
	double size = 1.0 + spread(rng, 0.02);
	struct shape shape = {.axes_m = {75 * MM * size * (1.0 + spread(rng, 0.02)),
					 110 * MM * size * (1.0 + spread(rng, 0.02)),
					 95 * MM * size * (1.0 + spread(rng, 0.02))}};

	for (int i = 0; i < FACE_RELIEF_COUNT; i++)
		shape.relief_scale[i] = size * (1.0 + spread(rng, 0.08));
	return shape;
}

/* The table describes the left side; `side` -1 mirrors it. */
static void set_shifts(struct face_marker *marker, double azimuth_deg, double elevation_deg)
{
	for (int i = 0; i < FACE_PULL_COUNT; i++) {
		const struct face_pull *p = &FACE_PULLS[i];

		for (int side = 1; side >= -1; side -= 2) {
			bool once = p->azimuth_deg == 0;
			bool wanted = p->side == 0 || p->side == side;

			if (!wanted || (once && side < 0))
				continue;
			double w = MM * lobe(azimuth_deg, elevation_deg, side * p->azimuth_deg,
					     p->elevation_deg, p->sigma_deg, p->sigma_deg);
			struct vec3 pull = {side * p->x_mm * w, p->y_mm * w, p->z_mm * w};

			marker->shift_m[p->expression] =
				vec3_add(marker->shift_m[p->expression], pull);
		}
	}
}

static double jaw_share_at(double azimuth_deg, double elevation_deg)
{
	double below_mouth = 1.0 / (1.0 + exp((elevation_deg + 35.0) / 1.6));
	double towards_ear = 1.0 / (1.0 + exp((fabs(azimuth_deg) - 62.0) / 8.0));

	return below_mouth * towards_ear;
}

static void add_marker(struct face *face, const char *name, const char *group)
{
	struct layout_marker *marker = &face->layout.markers[face->layout.marker_count++];

	snprintf(marker->name, sizeof(marker->name), "%s", name);
	snprintf(marker->group, sizeof(marker->group), "%s", group);
}

static void add_skin_marker(struct face *face, const struct shape *shape, struct rng *rng,
			    const struct face_spot *spot, int side)
{
	uint32_t index = face->layout.marker_count;
	struct face_marker *marker = &face->markers[index];
	double jitter_deg = strncmp(spot->group, "lip", 3) == 0 ? 0.2 : 0.7;
	double azimuth = side * spot->azimuth_deg + spread(rng, jitter_deg);
	double elevation = spot->elevation_deg + spread(rng, jitter_deg);
	char name[NAME_BYTES];

	if (side == 0)
		snprintf(name, sizeof(name), "%s_%d", spot->region, spot->number);
	else
		snprintf(name, sizeof(name), "%s_%c_%d", spot->region, side > 0 ? 'l' : 'r',
			 spot->number);
	add_marker(face, name, spot->group);
	face->layout.markers[index].neutral_m = surface_point(shape, azimuth, elevation);
	face->layout.markers[index].diameter_m = 1.5 * MM;
	marker->normal = surface_normal(shape, azimuth, elevation);
	marker->jaw_share = jaw_share_at(azimuth, elevation);
	marker->reflectivity = 1.0 + spread(rng, 0.12);
	marker->on_nose = strcmp(spot->group, "nose") == 0;
	set_shifts(marker, azimuth, elevation);
}

static void add_band_marker(struct face *face, const struct shape *shape, struct rng *rng, int i)
{
	const struct face_band_spot *spot = &FACE_BAND[i];
	uint32_t index = face->layout.marker_count;
	double azimuth = spot->azimuth_deg + spread(rng, 1.0);
	double elevation = spot->elevation_deg + spread(rng, 1.0);
	struct vec3 skin = surface_point(shape, azimuth, elevation);
	double tilt = spot->tilt_deg * RAD, turn = azimuth * RAD;
	char name[NAME_BYTES];

	snprintf(name, sizeof(name), "head_%d", i + 1);
	add_marker(face, name, "head");
	face->layout.markers[index].rigid = true;
	face->layout.markers[index].diameter_m = spot->diameter_mm * MM;
	face->markers[index].normal =
		(struct vec3){sin(turn) * cos(tilt), sin(tilt), cos(turn) * cos(tilt)};
	face->layout.markers[index].neutral_m =
		vec3_add(skin, vec3_scale(vec3_unit(skin), spot->stand_off_mm * MM));
	face->markers[index].reflectivity = 1.0 + spread(rng, 0.05);
}

void face_init(struct face *face, uint64_t seed)
{
	struct rng rng;
	struct shape shape;

	memset(face, 0, sizeof(*face));
	rng_init(&rng, seed, 1);
	shape = shape_of(&rng);
	face->skull = (struct ellipsoid){.axes_m = vec3_scale(shape.axes_m, 0.97)};
	struct vec3 nose = surface_point(&shape, 0, -14);
	face->nose = (struct ellipsoid){.centre_m = {0, nose.y, nose.z - 14 * MM},
					.axes_m = {10 * MM, 22 * MM, 13 * MM}};
	for (int i = 0; i < FACE_SPOT_COUNT; i++) {
		if (FACE_SPOTS[i].azimuth_deg == 0) {
			add_skin_marker(face, &shape, &rng, &FACE_SPOTS[i], 0);
			continue;
		}
		add_skin_marker(face, &shape, &rng, &FACE_SPOTS[i], 1);
		add_skin_marker(face, &shape, &rng, &FACE_SPOTS[i], -1);
	}
	for (int i = 0; i < FACE_BAND_COUNT; i++)
		add_band_marker(face, &shape, &rng, i);
	face->layout.actor_count = 1;
	face->layout.actors[0] = (struct layout_actor){"sim", 0, face->layout.marker_count};
}

struct vec3 face_marker_place(const struct face *face, uint32_t index,
			      const double weights[EXPRESSION_COUNT], struct vec3 *normal)
{
	const struct face_marker *marker = &face->markers[index];
	struct vec3 p = face->layout.markers[index].neutral_m;
	double jaw = weights[EXPRESSION_JAW_OPEN] * marker->jaw_share * JAW_ANGLE_RAD;
	struct pose turn = pose_from_rotation_vector((struct vec3){jaw, 0, 0});

	p = vec3_add(JAW_HINGE_M, pose_rotate(&turn, vec3_sub(p, JAW_HINGE_M)));
	for (int e = 0; e < EXPRESSION_COUNT; e++)
		p = vec3_add(p, vec3_scale(marker->shift_m[e], weights[e]));
	*normal = pose_rotate(&turn, marker->normal);
	return p;
}

static struct vec3 in_unit_sphere(const struct ellipsoid *e, struct vec3 p)
{
	struct vec3 d = vec3_sub(p, e->centre_m);

	return (struct vec3){d.x / e->axes_m.x, d.y / e->axes_m.y, d.z / e->axes_m.z};
}

static bool segment_meets(const struct ellipsoid *e, struct vec3 from, struct vec3 to)
{
	struct vec3 a = in_unit_sphere(e, from);
	struct vec3 d = vec3_sub(in_unit_sphere(e, to), a);
	double nearest = -vec3_dot(a, d) / vec3_dot(d, d);

	if (nearest <= 0 || nearest >= 1)
		return false;
	a = vec3_add(a, vec3_scale(d, nearest));
	return vec3_dot(a, a) < 1.0;
}

bool face_hides(const struct face *face, uint32_t marker, struct vec3 from, struct vec3 to)
{
	if (segment_meets(&face->skull, from, to))
		return true;
	return !face->markers[marker].on_nose && segment_meets(&face->nose, from, to);
}
