/*
 * The lower envelope: bin minima, their lower convex hull, and of its edges the one above the mean
 * of the window, which is the line below all points that is nearest to them in sum.
 */
#include "drivers/clock_map.h"

#include <math.h>
#include <string.h>

#define BIN_NS INT64_C(500000000)
#define DRIFT_MAX 200e-6          /* quartz is within 100 ppm on either side */
#define STEP_NS INT64_C(20000000) /* no path is this much slower for STEP_BINS long */
#define STEP_BINS 4
#define YOUNG_SAMPLES 8
#define YOUNG_NS 1000000.0 /* spread assumed of a map with fewer samples than that */
#define ANCHOR_DELAY_MAX_NS INT64_C(1000000000)
#define YOUNG_BINS 10 /* with fewer the drift is a guess */

static double line_delay(const struct clock_map *map, int64_t device_ns)
{
	return (double)map->base_delay_ns + map->drift * (double)(device_ns - map->base_device_ns);
}

static void restart(struct clock_map *map)
{
	map->count = 0;
	map->samples = 0;
	map->resets++;
	map->anchored = false;
	map->last_device_ns = 0;
	map->last_host_ns = 0;
}

/* True when the last bins all lie far above the line: the device's clock stepped back. */
static bool stepped_back(const struct clock_map *map)
{
	if (map->count <= STEP_BINS)
		return false;
	for (uint32_t i = map->count - STEP_BINS; i < map->count; i++) {
		const struct clock_map_point *p = &map->points[i];

		if ((double)p->delay_ns - line_delay(map, p->device_ns) < STEP_NS)
			return false;
	}
	return true;
}

static bool stepped(const struct clock_map *map, int64_t device_ns, int64_t delay_ns)
{
	if (!map->count)
		return false;
	if (device_ns <= map->points[map->count - 1].device_ns - BIN_NS)
		return true;
	return (double)delay_ns - line_delay(map, device_ns) < -STEP_NS || stepped_back(map);
}

static void append(struct clock_map *map, struct clock_map_point point)
{
	if (map->count == CLOCK_MAP_BINS) {
		memmove(map->points, map->points + 1, sizeof(point) * (CLOCK_MAP_BINS - 1));
		map->count--;
	}
	map->points[map->count++] = point;
}

/* Bins start at multiples of BIN_NS of the device's clock and keep their earliest message. */
static void insert(struct clock_map *map, struct clock_map_point point)
{
	struct clock_map_point *last = map->count ? &map->points[map->count - 1] : NULL;

	if (!last || last->device_ns / BIN_NS < point.device_ns / BIN_NS)
		append(map, point);
	else if (point.delay_ns < last->delay_ns)
		*last = point;
}

static double slope(const struct clock_map_point *a, const struct clock_map_point *b)
{
	return (double)(b->delay_ns - a->delay_ns) / (double)(b->device_ns - a->device_ns);
}

/* Lower convex hull of the points (Andrew's monotone chain); returns its size. */
static uint32_t lower_hull(const struct clock_map *map, uint32_t hull[CLOCK_MAP_BINS])
{
	const struct clock_map_point *p = map->points;
	uint32_t size = 0;

	for (uint32_t i = 0; i < map->count; i++) {
		while (size >= 2 && slope(&p[hull[size - 2]], &p[hull[size - 1]]) >=
					    slope(&p[hull[size - 1]], &p[i]))
			size--;
		hull[size++] = i;
	}
	return size;
}

/* The slope of the hull's edge that spans the mean of the window. */
static double envelope_drift(const struct clock_map *map)
{
	uint32_t hull[CLOCK_MAP_BINS];
	uint32_t size = lower_hull(map, hull);
	int64_t origin_ns = map->points[0].device_ns;
	int64_t mean_ns = 0;
	uint32_t edge = 0;

	if (size < 2)
		return 0.0;
	for (uint32_t i = 0; i < map->count; i++)
		mean_ns += (map->points[i].device_ns - origin_ns) / map->count;
	while (edge + 2 < size && map->points[hull[edge + 1]].device_ns - origin_ns < mean_ns)
		edge++;
	return fmax(-DRIFT_MAX,
		    fmin(DRIFT_MAX, slope(&map->points[hull[edge]], &map->points[hull[edge + 1]])));
}

/* Keeps them in order; qsort() may allocate. */
static void insert_height(double *heights, uint32_t count, double height)
{
	uint32_t place = count;

	for (; place > 0 && heights[place - 1] > height; place--)
		heights[place] = heights[place - 1];
	heights[place] = height;
}

/* The line of that slope that touches the points from below. A stall lifts a bin or two by its
 * whole length, and says nothing of the others: the median height does not hear of it. */
static void fit(struct clock_map *map)
{
	double heights[CLOCK_MAP_BINS];

	map->drift = envelope_drift(map);
	map->base_device_ns = map->points[0].device_ns;
	map->base_delay_ns = map->points[0].delay_ns;
	for (uint32_t i = 0; i < map->count; i++)
		insert_height(heights, i,
			      (double)map->points[i].delay_ns -
				      line_delay(map, map->points[i].device_ns));
	map->base_delay_ns += (int64_t)floor(heights[0]);
	map->residual_ns = heights[map->count / 2] - floor(heights[0]);
}

void clock_map_anchor(struct clock_map *map, int64_t device_ns, int64_t host_ns, int64_t bound_ns)
{
	map->anchored = true;
	map->anchor = (struct clock_map_point){device_ns, host_ns - device_ns};
	map->anchor_bound_ns = bound_ns;
}

/* A reading that the first message contradicts was of another clock than that of the stamps. */
static bool anchor_holds(const struct clock_map *map, int64_t device_ns, int64_t delay_ns)
{
	double drift_ns = DRIFT_MAX * fabs((double)(device_ns - map->anchor.device_ns));
	int64_t slack_ns = map->anchor_bound_ns + llround(drift_ns);

	return device_ns >= map->anchor.device_ns - slack_ns &&
	       delay_ns >= map->anchor.delay_ns - slack_ns &&
	       delay_ns < map->anchor.delay_ns + ANCHOR_DELAY_MAX_NS;
}

/* The line at the anchor is as much above it as the fastest message travels. */
static void learn_path(struct clock_map *map)
{
	if (!map->anchored || map->count < YOUNG_BINS)
		return;
	map->path_ns = llround(line_delay(map, map->anchor.device_ns)) - map->anchor.delay_ns;
	map->path_bound_ns = map->anchor_bound_ns + llround(7.0 * map->residual_ns);
	if (map->count == CLOCK_MAP_BINS)
		map->anchored = false;
}

void clock_map_sample(struct clock_map *map, int64_t device_ns, int64_t host_ns)
{
	int64_t delay_ns = host_ns - device_ns;

	if (stepped(map, device_ns, delay_ns))
		restart(map);
	if (map->anchored && !map->samples)
		map->anchored = anchor_holds(map, device_ns, delay_ns);
	insert(map, (struct clock_map_point){device_ns, delay_ns});
	map->samples++;
	fit(map);
	learn_path(map);
}

/* How far the line may be from the truth, apart from the path. */
static double spread_ns(const struct clock_map *map, int64_t device_ns)
{
	double spread = 3.0 * map->residual_ns;

	if (map->samples < YOUNG_SAMPLES)
		spread += YOUNG_NS;
	if (map->count < YOUNG_BINS)
		spread += DRIFT_MAX * fabs((double)(device_ns - map->points[0].device_ns));
	return spread;
}

static int64_t by_line(const struct clock_map *map, int64_t device_ns, int64_t *uncertainty_ns)
{
	*uncertainty_ns = map->path_bound_ns + llround(spread_ns(map, device_ns));
	return device_ns + llround(line_delay(map, device_ns)) - map->path_ns;
}

/* While the drift is unknown the reading alone says more than the line. */
static int64_t by_anchor(const struct clock_map *map, int64_t device_ns, int64_t *uncertainty_ns)
{
	double age_ns = fabs((double)(device_ns - map->anchor.device_ns));

	*uncertainty_ns = map->anchor_bound_ns + llround(DRIFT_MAX * age_ns);
	return device_ns + map->anchor.delay_ns;
}

int64_t clock_map_host_ns(struct clock_map *map, int64_t device_ns, int64_t *uncertainty_ns)
{
	bool young = map->anchored && map->count < YOUNG_BINS;
	int64_t host_ns = young ? by_anchor(map, device_ns, uncertainty_ns)
				: by_line(map, device_ns, uncertainty_ns);

	if (map->last_host_ns && device_ns > map->last_device_ns && host_ns <= map->last_host_ns)
		host_ns = map->last_host_ns + 1;
	map->last_device_ns = device_ns;
	map->last_host_ns = host_ns;
	return host_ns;
}
