/*
 * drivers/gpio/trigger_guard.h without a process.
 */
#include "tests/gpio/fake_guard.h"

#include "base/clock.h"
#include "drivers/gpio/gpio_lines.h"
#include "drivers/gpio/trigger_guard.h"

struct fake_guard fake_guard;

int trigger_guard_start(struct trigger_guard *guard, int lines_fd, uint32_t count,
			uint32_t dark_levels, const char *who, struct diag *diag)
{
	(void)who, (void)diag;
	guard->pid = 1;
	fake_guard.lines_fd = lines_fd;
	fake_guard.count = count;
	fake_guard.dark_levels = dark_levels;
	fake_guard.starts++;
	fake_guard.dead = false;
	return 0;
}

void trigger_guard_stop(struct trigger_guard *guard)
{
	guard->pid = 0;
}

static void tell(int64_t until_ns)
{
	uint32_t i = fake_guard.told_count++ % FAKE_GUARD_WATCHES;

	fake_guard.told[i].at_ns = clock_now_ns();
	fake_guard.told[i].until_ns = fake_guard.until_ns = until_ns;
}

void trigger_guard_watch(struct trigger_guard *guard, int64_t until_ns)
{
	(void)guard;
	tell(until_ns);
}

void trigger_guard_rest(struct trigger_guard *guard)
{
	(void)guard;
	tell(0);
}

bool trigger_guard_lives(const struct trigger_guard *guard)
{
	return guard->pid && !fake_guard.dead;
}

bool trigger_guard_has_cut(struct trigger_guard *guard)
{
	if (fake_guard.until_ns && clock_now_ns() >= fake_guard.until_ns) {
		gpio_fd_set(fake_guard.lines_fd, fake_guard.count, fake_guard.dark_levels);
		fake_guard.until_ns = 0;
		fake_guard.cut_count++;
	}
	bool cut = fake_guard.cut_count != guard->cuts_seen;

	guard->cuts_seen = fake_guard.cut_count;
	return cut;
}
