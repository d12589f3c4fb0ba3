/*
 * The rules, in the order in which a plan is read. Durations are bounded before they are added, so
 * that no sum overflows.
 */
#include "drivers/trigger_plan.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>

#include "base/clock.h"

#define PERIOD_MAX_NS (10 * NS_PER_S)
#define DIVIDER_MAX 1000

struct check {
	const struct trigger_plan *plan;
	plan_problem_fn *problem;
	void *user;
	int found;
};

static double us(int64_t time_ns)
{
	return (double)time_ns / NS_PER_US;
}

static void __attribute__((format(printf, 3, 4)))
tell(struct check *check, enum plan_field field, const char *format, ...)
{
	char text[256];
	va_list arguments;

	va_start(arguments, format);
	vsnprintf(text, sizeof(text), format, arguments);
	va_end(arguments);
	check->found++;
	check->problem(field, text, check->user);
}

/* The time from an edge on to the end of something; -1, and told, when it cannot be computed. */
static int64_t end_of(struct check *check, enum plan_field delay_field, int64_t delay_ns,
		      enum plan_field length_field, int64_t length_ns)
{
	if (delay_ns < 0)
		tell(check, delay_field, "%.6g us is before the edge; give 0 or more",
		     us(delay_ns));
	if (length_ns < 0)
		tell(check, length_field, "%.6g us is a negative time; give 0 or more",
		     us(length_ns));
	if (delay_ns < 0 || length_ns < 0)
		return -1;
	return delay_ns > INT64_MAX - length_ns ? INT64_MAX : delay_ns + length_ns;
}

/* Something that repeats must be over before it begins again. */
static void check_fits(struct check *check, enum plan_field field, int64_t delay_ns,
		       int64_t length_ns, int64_t end_ns, int64_t limit_ns, const char *what)
{
	if (length_ns >= limit_ns)
		tell(check, field,
		     "%.6g us does not fit between two %s, which are %.6g us apart; lower it or "
		     "the rate",
		     us(length_ns), what, us(limit_ns));
	else if (end_ns > limit_ns)
		tell(check, field,
		     "%.6g us, begun %.6g us after the edge, ends after the next of the %s, which "
		     "are %.6g us apart; shorten it or its delay",
		     us(length_ns), us(delay_ns), what, us(limit_ns));
}

static void check_ir(struct check *check)
{
	const struct trigger_plan *plan = check->plan;
	int64_t end_ns = end_of(check, PLAN_IR_DELAY, plan->ir_delay_ns, PLAN_IR_EXPOSURE,
				plan->ir_exposure_ns);

	if (plan->ir_exposure_ns == 0)
		tell(check, PLAN_IR_EXPOSURE, "an exposure of 0 us sees nothing; give 250 or so");
	if (end_ns >= 0)
		check_fits(check, PLAN_IR_EXPOSURE, plan->ir_delay_ns, plan->ir_exposure_ns, end_ns,
			   plan->period_ns, "shots");
}

static void check_duty(struct check *check)
{
	const struct trigger_plan *plan = check->plan;
	double duty_max =
		plan->strobe_duty_max > 0 ? plan->strobe_duty_max : STROBE_DUTY_MAX_DEFAULT;
	double width_max_ns = duty_max * (double)plan->period_ns;

	if (plan->strobe_duty_max < 0 || plan->strobe_duty_max > 1)
		tell(check, PLAN_STROBE_DUTY, "%g is not a share of the time, from 0 to 1",
		     plan->strobe_duty_max);
	else if ((double)plan->strobe_width_ns > width_max_ns)
		tell(check, PLAN_STROBE_WIDTH,
		     "%.6g us of every %.6g us overheats a strobe that may burn %g of the time; "
		     "give at most %.6g us, or lower the rate",
		     us(plan->strobe_width_ns), us(plan->period_ns), duty_max,
		     width_max_ns / NS_PER_US);
}

static void check_strobe(struct check *check)
{
	const struct trigger_plan *plan = check->plan;
	int64_t end_ns = end_of(check, PLAN_STROBE_DELAY, plan->strobe_delay_ns, PLAN_STROBE_WIDTH,
				plan->strobe_width_ns);

	if (end_ns < 0)
		return;
	check_duty(check);
	if (plan->strobe_width_ns == 0 || plan->ir_delay_ns < 0 || plan->ir_exposure_ns < 0 ||
	    plan->ir_delay_ns > PERIOD_MAX_NS || plan->ir_exposure_ns > PERIOD_MAX_NS)
		return;
	int64_t shut_ns = plan->ir_delay_ns + plan->ir_exposure_ns;
	if (plan->strobe_delay_ns < plan->ir_delay_ns || end_ns > shut_ns)
		tell(check, PLAN_STROBE_DELAY,
		     "the strobe burns %.6g to %.6g us after the edge, outside the exposure, which "
		     "is open %.6g to %.6g us; move or shorten the strobe",
		     us(plan->strobe_delay_ns), us(end_ns), us(plan->ir_delay_ns), us(shut_ns));
}

static void check_hd(struct check *check)
{
	const struct trigger_plan *plan = check->plan;
	int64_t end_ns = end_of(check, PLAN_HD_DELAY, plan->hd_delay_ns, PLAN_HD_EXPOSURE,
				plan->hd_exposure_ns);

	if (plan->hd_divider < 1 || plan->hd_divider > DIVIDER_MAX) {
		tell(check, PLAN_HD_DIVIDER,
		     "HD cameras cannot take every %d-th shot; give 1 to %d, 4 for 30 Hz beside "
		     "120 Hz",
		     plan->hd_divider, DIVIDER_MAX);
		return;
	}
	if (plan->hd_phase < 0 || plan->hd_phase >= plan->hd_divider)
		tell(check, PLAN_HD_PHASE,
		     "%d is not a shot of the %d that an HD frame comes in; give 0 to %d",
		     plan->hd_phase, plan->hd_divider, plan->hd_divider - 1);
	if (end_ns >= 0)
		check_fits(check, PLAN_HD_EXPOSURE, plan->hd_delay_ns, plan->hd_exposure_ns, end_ns,
			   plan->period_ns * plan->hd_divider, "HD frames");
}

int trigger_plan_problems(const struct trigger_plan *plan, plan_problem_fn *problem, void *user)
{
	struct check check = {plan, problem, user, 0};

	if (plan->period_ns <= 0 || plan->period_ns > PERIOD_MAX_NS) {
		tell(&check, PLAN_PERIOD, "shots cannot be %.6g us apart; give above 0, at most %g",
		     us(plan->period_ns), us(PERIOD_MAX_NS));
		return -EINVAL;
	}
	check_ir(&check);
	check_strobe(&check);
	check_hd(&check);
	return check.found ? -EINVAL : 0;
}

struct armed {
	const char *who;
	struct diag *diag;
};

static void tell_diag(enum plan_field field, const char *text, void *user)
{
	static const char *const names[] = {
		[PLAN_PERIOD] = "period",
		[PLAN_IR_DELAY] = "ir_delay",
		[PLAN_IR_EXPOSURE] = "exposure",
		[PLAN_STROBE_DELAY] = "strobe_delay",
		[PLAN_STROBE_WIDTH] = "strobe_width",
		[PLAN_STROBE_DUTY] = "strobe_duty_max",
		[PLAN_HD_DIVIDER] = "hd.divider",
		[PLAN_HD_PHASE] = "hd.phase",
		[PLAN_HD_DELAY] = "hd.delay",
		[PLAN_HD_EXPOSURE] = "hd.exposure",
	};
	const struct armed *armed = user;

	diag_add(armed->diag, "trigger %s: the plan's %s: %s", armed->who, names[field], text);
}

int trigger_plan_check(const struct trigger_plan *plan, const char *who, struct diag *diag)
{
	struct armed armed = {who, diag};

	return trigger_plan_problems(plan, tell_diag, &armed);
}

int64_t trigger_plan_ir_middle_ns(const struct trigger_plan *plan)
{
	int64_t begin_ns = plan->ir_delay_ns, end_ns = plan->ir_delay_ns + plan->ir_exposure_ns;
	int64_t lit_ns = plan->strobe_delay_ns,
		dark_ns = plan->strobe_delay_ns + plan->strobe_width_ns;

	if (plan->strobe_width_ns > 0 && lit_ns < end_ns && dark_ns > begin_ns) {
		begin_ns = lit_ns > begin_ns ? lit_ns : begin_ns;
		end_ns = dark_ns < end_ns ? dark_ns : end_ns;
	}
	return begin_ns + (end_ns - begin_ns) / 2;
}

int64_t trigger_plan_hd_middle_ns(const struct trigger_plan *plan)
{
	return plan->hd_delay_ns + plan->hd_exposure_ns / 2;
}
