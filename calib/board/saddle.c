/*
 * Levenberg-Marquardt on one corner.
 */
#include "calib/board/saddle.h"

#include <errno.h>
#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "calib/solve/small_solve.h"

#define PIXELS_MAX 1200
#define PIXELS_MIN 25
#define ROUNDS 25
#define BLUR_START_PX 0.9
#define BLUR_MIN_PX 0.25
#define DONE_PX 1e-3
#define WINDOWS_MAX 3
#define OFF_CENTRE_PX 0.3
#define LOST_PART 0.15 /* of a square: that is not the corner that was meant */
#define CONTRAST_MIN 8 /* grey values, half of white less black */
#define MISFIT_MAX 0.3

enum { AT_X, AT_Y, ANGLE_1, ANGLE_2, BLUR_1, BLUR_2, HALF, BASE, PARAMETERS };

struct window {
	int count;
	double x[PIXELS_MAX], y[PIXELS_MAX], grey[PIXELS_MAX];
};

/* Board coordinates of a place relative to the guess, in squares. */
struct to_squares {
	double m[4];
};

static int invert_axes(struct to_squares *to, const struct saddle_guess *guess)
{
	const double *a = guess->along_x_px, *b = guess->along_y_px;
	double determinant = a[0] * b[1] - a[1] * b[0];

	if (!(fabs(determinant) > 1))
		return -EDOM;
	*to = (struct to_squares){
		{b[1] / determinant, -b[0] / determinant, -a[1] / determinant, a[0] / determinant}};
	return 0;
}

static bool in_cross(const struct to_squares *to, const double reach[2], double dx, double dy)
{
	double u = fabs(to->m[0] * dx + to->m[1] * dy), v = fabs(to->m[2] * dx + to->m[3] * dy);

	return (u <= SADDLE_ACROSS && v <= reach[1]) || (v <= SADDLE_ACROSS && u <= reach[0]);
}

static int read_window(struct window *window, const struct grey_image *image,
		       const struct saddle_guess *guess)
{
	struct to_squares to;
	double reach[2] = {fmin(SADDLE_ALONG, SADDLE_ALONG_MAX_PX / hypot(guess->along_x_px[0],
									  guess->along_x_px[1])),
			   fmin(SADDLE_ALONG, SADDLE_ALONG_MAX_PX / hypot(guess->along_y_px[0],
									  guess->along_y_px[1]))};

	if (invert_axes(&to, guess))
		return -EDOM;
	for (int i = 0; i < 2; i++)
		reach[i] = fmax(reach[i], SADDLE_ACROSS);
	/* the box of the cross */
	double half[2];
	for (int i = 0; i < 2; i++)
		half[i] = reach[0] * fabs(guess->along_x_px[i]) +
			  reach[1] * fabs(guess->along_y_px[i]);
	int x0 = (int)ceil(guess->px[0] - half[0]), x1 = (int)floor(guess->px[0] + half[0]);
	int y0 = (int)ceil(guess->px[1] - half[1]), y1 = (int)floor(guess->px[1] + half[1]);

	if (x0 < 0 || y0 < 0 || x1 >= image->width_px || y1 >= image->height_px)
		return -EDOM;
	window->count = 0;
	for (int y = y0; y <= y1; y++)
		for (int x = x0; x <= x1; x++) {
			if (!in_cross(&to, reach, x - guess->px[0], y - guess->px[1]))
				continue;
			if (window->count == PIXELS_MAX)
				return -EDOM;
			window->x[window->count] = x;
			window->y[window->count] = y;
			window->grey[window->count++] =
				image->pixels[(size_t)y * (size_t)image->stride_bytes + (size_t)x];
		}
	return window->count >= PIXELS_MIN ? 0 : -EDOM;
}

/* A line through the corner as the numbers have it now. */
struct line {
	double sine, cosine, blur, slope; /* of value by distance, on the line */
};

static struct line line_of(double angle, double blur)
{
	return (struct line){sin(angle), cos(angle), blur, sqrt(2 / M_PI) / blur};
}

/* Value of the blurred edge, -1 to 1, and its derivative by the distance. */
struct edge {
	double value, slope, distance;
};

/* erf after Hastings (Abramowitz and Stegun 7.1.26), to 1.5e-7: its exponential is the slope's. */
static struct edge edge_at(const struct line *line, double dx, double dy)
{
	double distance = line->cosine * dy - line->sine * dx;
	double t = distance / line->blur, x = fabs(t) * M_SQRT1_2;
	double bell = exp(-x * x), k = 1 / (1 + 0.3275911 * x);
	double tail =
		k * (0.254829592 +
		     k * (-0.284496736 + k * (1.421413741 + k * (-1.453152027 + k * 1.061405429))));

	return (struct edge){copysign(1 - tail * bell, t), line->slope * bell, distance};
}

/* Adds the window's equations for a step from `p` to a and b; returns the sum of squares at `p`. */
static double add_window(double a[PARAMETERS * PARAMETERS], double b[PARAMETERS],
			 const struct window *window, const double p[PARAMETERS])
{
	struct line l1 = line_of(p[ANGLE_1], p[BLUR_1]), l2 = line_of(p[ANGLE_2], p[BLUR_2]);
	double sum = 0;

	memset(a, 0, PARAMETERS * PARAMETERS * sizeof(*a));
	memset(b, 0, PARAMETERS * sizeof(*b));
	for (int i = 0; i < window->count; i++) {
		double dx = window->x[i] - p[AT_X], dy = window->y[i] - p[AT_Y];
		struct edge e1 = edge_at(&l1, dx, dy), e2 = edge_at(&l2, dx, dy);
		double by_1 = p[HALF] * e1.slope * e2.value, by_2 = p[HALF] * e2.slope * e1.value;
		const double row[PARAMETERS] = {[AT_X] = by_1 * l1.sine + by_2 * l2.sine,
						[AT_Y] = -by_1 * l1.cosine - by_2 * l2.cosine,
						[ANGLE_1] = -by_1 * (l1.cosine * dx + l1.sine * dy),
						[ANGLE_2] = -by_2 * (l2.cosine * dx + l2.sine * dy),
						[BLUR_1] = -by_1 * e1.distance / l1.blur,
						[BLUR_2] = -by_2 * e2.distance / l2.blur,
						[HALF] = e1.value * e2.value,
						[BASE] = 1};
		double left = window->grey[i] - p[BASE] - p[HALF] * row[HALF];

		small_solve_add(PARAMETERS, a, b, row, left, 1);
		sum += left * left;
	}
	return sum;
}

/* The equations at a place, and what is left there. */
struct place {
	double p[PARAMETERS], a[PARAMETERS * PARAMETERS], b[PARAMETERS], sum;
};

static void visit(struct place *place, const struct window *window)
{
	place->sum = add_window(place->a, place->b, window, place->p);
}

/* Contrast and base are linear: solved with the other numbers as guessed. */
static int start(struct place *place, const struct window *window, const struct saddle_guess *guess)
{
	const double numbers[PARAMETERS] = {
		[AT_X] = guess->px[0],
		[AT_Y] = guess->px[1],
		[ANGLE_1] = atan2(guess->along_x_px[1], guess->along_x_px[0]),
		[ANGLE_2] = atan2(guess->along_y_px[1], guess->along_y_px[0]),
		[BLUR_1] = BLUR_START_PX,
		[BLUR_2] = BLUR_START_PX};

	memcpy(place->p, numbers, sizeof(numbers));
	visit(place, window);
	double a[4] = {place->a[HALF * PARAMETERS + HALF], place->a[HALF * PARAMETERS + BASE],
		       place->a[BASE * PARAMETERS + HALF], place->a[BASE * PARAMETERS + BASE]};
	double b[2] = {place->b[HALF], place->b[BASE]};
	if (small_solve(2, a, b))
		return -EDOM;
	place->p[HALF] = b[0];
	place->p[BASE] = b[1];
	visit(place, window);
	return 0;
}

/* One damped step; true when it made things better. */
static bool improve(struct place *place, double damping, const struct window *window,
		    double *moved_px)
{
	double a[PARAMETERS * PARAMETERS], b[PARAMETERS];
	struct place next = *place;

	memcpy(a, place->a, sizeof(a));
	memcpy(b, place->b, sizeof(b));
	for (int k = 0; k < PARAMETERS; k++)
		a[k * PARAMETERS + k] *= 1 + damping;
	if (small_solve(PARAMETERS, a, b))
		return false;
	for (int k = 0; k < PARAMETERS; k++)
		next.p[k] += b[k];
	next.p[BLUR_1] = fmax(next.p[BLUR_1], BLUR_MIN_PX);
	next.p[BLUR_2] = fmax(next.p[BLUR_2], BLUR_MIN_PX);
	visit(&next, window);
	if (!(next.sum < place->sum))
		return false;
	*moved_px = hypot(b[AT_X], b[AT_Y]);
	*place = next;
	return true;
}

static void descend(struct place *place, const struct window *window)
{
	double damping = 1e-3, moved_px;

	for (int round = 0; round < ROUNDS && damping < 1e6; round++) {
		if (!improve(place, damping, window, &moved_px)) {
			damping *= 10;
			continue;
		}
		damping *= 0.1;
		if (moved_px < DONE_PX)
			break;
	}
}

int saddle_fit(struct saddle *saddle, const struct grey_image *image,
	       const struct saddle_guess *guess)
{
	struct saddle_guess at = *guess;
	struct place place;
	struct window window;
	double off_px = INFINITY;

	for (int again = 0; again < WINDOWS_MAX && off_px > OFF_CENTRE_PX;
	     again++) { /* the window is to be about the corner */
		if (read_window(&window, image, &at) || start(&place, &window, &at))
			return -EDOM;
		descend(&place, &window);
		off_px = hypot(place.p[AT_X] - at.px[0], place.p[AT_Y] - at.px[1]);
		memcpy(at.px, place.p, sizeof(at.px));
		if (!(hypot(at.px[0] - guess->px[0], at.px[1] - guess->px[1]) <
		      LOST_PART * saddle_edge_px(guess)))
			return -EDOM;
	}
	double misfit = sqrt(place.sum / window.count) / fabs(place.p[HALF]);

	if (!(fabs(place.p[HALF]) > CONTRAST_MIN) || !(misfit < MISFIT_MAX))
		return -EDOM;
	*saddle = (struct saddle){.px = {place.p[AT_X], place.p[AT_Y]},
				  .blur_px = {place.p[BLUR_1], place.p[BLUR_2]},
				  .contrast = 2 * place.p[HALF],
				  .misfit = misfit};
	return 0;
}
