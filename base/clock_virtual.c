/*
 * The conductor has no thread of its own: whoever comes to rest last looks who is next. One mutex
 * guards all of it but the time itself.
 *
 * At one moment of time all sleepers that are due go first, then who waits on a semaphore, then
 * alarms; so what happens does not depend on which thread the machine ran first.
 */
#include "base/clock_virtual.h"

#include <assert.h>
#include <errno.h>
#include <pthread.h>
#include <string.h>
#include <sys/eventfd.h>

#include "base/clock_conductor.h"
#include "base/realtime.h"

struct waiter {
	struct clock_semaphore *semaphore; /* NULL: sleeps */
	int64_t wake_ns;
	bool counted; /* its thread is one of those that time waits for */
	sem_t woken;
	struct waiter *next;
};

static bool is_virtual; /* before the threads start */
static _Atomic int64_t now_ns;
static _Thread_local bool is_counted;

static struct {
	pthread_mutex_t mutex;
	struct waiter *waiters; /* each on the stack of its thread */
	struct clock_alarm *alarms;
	int busy_count; /* counted threads that do not wait */
	int hold_count;
	int rush_count;
	int64_t limit_ns;
	bool in_section; /* whoever holds the mutex was, and will be, in a real-time section */
} conductor = {.mutex = PTHREAD_MUTEX_INITIALIZER};

static void wake(struct waiter **link)
{
	struct waiter *waiter = *link;

	*link = waiter->next;
	if (waiter->semaphore)
		atomic_store(&waiter->semaphore->posted, false);
	if (waiter->counted)
		conductor.busy_count++;
	sem_post(&waiter->woken);
}

static bool is_due(const struct waiter *waiter, bool on_semaphore)
{
	if (on_semaphore != (waiter->semaphore != NULL))
		return false;
	return waiter->wake_ns <= atomic_load(&now_ns) ||
	       (on_semaphore && atomic_load(&waiter->semaphore->posted));
}

static bool wake_due(bool on_semaphore)
{
	bool any = false;

	for (struct waiter **link = &conductor.waiters; *link;) {
		if (is_due(*link, on_semaphore)) {
			wake(link);
			any = true;
		} else {
			link = &(*link)->next;
		}
	}
	return any;
}

static bool ring_due_alarms(void)
{
	bool any = false;

	for (struct clock_alarm *alarm = conductor.alarms; alarm; alarm = alarm->next) {
		if (alarm->due || alarm->wake_ns > atomic_load(&now_ns))
			continue;
		alarm->due = true;
		conductor.hold_count++;
		eventfd_write(alarm->fd, 1);
		any = true;
	}
	return any;
}

static int64_t earliest_ns(void)
{
	int64_t earliest = INT64_MAX;

	for (const struct waiter *waiter = conductor.waiters; waiter; waiter = waiter->next)
		if (waiter->wake_ns < earliest)
			earliest = waiter->wake_ns;
	for (const struct clock_alarm *alarm = conductor.alarms; alarm; alarm = alarm->next)
		if (!alarm->due && alarm->wake_ns < earliest && conductor.rush_count == 0)
			earliest = alarm->wake_ns;
	return earliest;
}

/* To the next moment at which somebody wants to wake. False when there is none yet. */
static bool advance(void)
{
	int64_t next_ns = earliest_ns();

	if (next_ns == INT64_MAX)
		return false;
	if (next_ns > conductor.limit_ns && conductor.rush_count == 0) {
		if (conductor.limit_ns > atomic_load(&now_ns))
			atomic_store(&now_ns, conductor.limit_ns);
		return false;
	}
	if (next_ns > atomic_load(&now_ns))
		atomic_store(&now_ns, next_ns);
	return true;
}

/* Called whenever somebody came to rest; wakes those who are next, if all rest. */
static void conduct(void)
{
	bool rushing = conductor.rush_count > 0;

	while (conductor.busy_count == 0) {
		if (wake_due(false) || wake_due(true))
			continue; /* until those that woke rest again, or were not counted */
		if (!rushing && (conductor.hold_count > 0 || ring_due_alarms()))
			return;
		if (!advance())
			return;
	}
}

/* Virtual time is made of locks; the sections of those who live in it pause around them. */
static void lock(void)
{
	bool in_section = realtime_pause();

	pthread_mutex_lock(&conductor.mutex);
	conductor.in_section = in_section;
}

static void unlock(void)
{
	bool in_section = conductor.in_section;

	pthread_mutex_unlock(&conductor.mutex);
	realtime_resume(in_section);
}

bool clock_is_virtual(void)
{
	return is_virtual;
}

int64_t conductor_now_ns(void)
{
	return atomic_load(&now_ns);
}

void clock_virtual_begin(int64_t start_ns, int64_t limit_ns)
{
	assert(!is_virtual && start_ns > 0);
	conductor.busy_count = conductor.hold_count = conductor.rush_count = 0;
	conductor.limit_ns = limit_ns;
	atomic_store(&now_ns, start_ns);
	is_virtual = true;
}

void clock_virtual_end(void)
{
	assert(!conductor.waiters && !conductor.alarms);
	is_virtual = false;
	is_counted = false;
}

void conductor_wait(struct clock_semaphore *semaphore, int64_t wake_ns)
{
	struct waiter waiter = {.semaphore = semaphore, .wake_ns = wake_ns, .counted = is_counted};

	if (!semaphore && wake_ns <= conductor_now_ns())
		return;
	bool in_section = realtime_pause();

	sem_init(&waiter.woken, 0, 0);
	lock();
	waiter.next = conductor.waiters;
	conductor.waiters = &waiter;
	conductor.busy_count -= waiter.counted;
	conduct();
	unlock();
	while (sem_wait(&waiter.woken) < 0 && errno == EINTR)
		;
	sem_destroy(&waiter.woken);
	realtime_resume(in_section);
}

void conductor_post(struct clock_semaphore *semaphore)
{
	lock();
	atomic_store(&semaphore->posted, true);
	conduct();
	unlock();
}

/* Adds to a count of what time waits for; less of it may let time run. */
static void change(int *count, int more)
{
	if (!is_virtual)
		return;
	lock();
	*count += more;
	assert(*count >= 0);
	if (more < 0)
		conduct();
	unlock();
}

void clock_thread_expect(void)
{
	change(&conductor.busy_count, 1);
}

void clock_thread_withdraw(void)
{
	change(&conductor.busy_count, -1);
}

void clock_thread_begin(void)
{
	is_counted = is_virtual;
}

void clock_thread_end(void)
{
	if (is_counted)
		change(&conductor.busy_count, -1);
	is_counted = false;
}

void clock_hold(void)
{
	change(&conductor.hold_count, 1);
}

void clock_release(void)
{
	change(&conductor.hold_count, -1);
}

void clock_rush_begin(void)
{
	if (!is_virtual)
		return;
	lock();
	conductor.rush_count++;
	conductor.busy_count -= is_counted;
	conduct();
	unlock();
}

void clock_rush_end(void)
{
	if (!is_virtual)
		return;
	lock();
	conductor.rush_count--;
	conductor.busy_count += is_counted;
	if (conductor.limit_ns < atomic_load(&now_ns))
		conductor.limit_ns = atomic_load(&now_ns);
	unlock();
}

int conductor_alarm_open(struct clock_alarm *alarm)
{
	int fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);

	if (fd < 0)
		return -errno;
	lock();
	*alarm = (struct clock_alarm){.fd = fd, .wake_ns = INT64_MAX, .next = conductor.alarms};
	conductor.alarms = alarm;
	unlock();
	return 0;
}

void conductor_alarm_set(struct clock_alarm *alarm, int64_t wake_ns)
{
	lock();
	alarm->wake_ns = wake_ns;
	conductor.hold_count -= alarm->due;
	alarm->due = false;
	conduct();
	unlock();
}

void conductor_alarm_remove(struct clock_alarm *alarm)
{
	struct clock_alarm **link = &conductor.alarms;

	conductor_alarm_set(alarm, INT64_MAX);
	lock();
	while (*link != alarm)
		link = &(*link)->next;
	*link = alarm->next;
	unlock();
}

void clock_virtual_set_limit(int64_t limit_ns)
{
	lock();
	conductor.limit_ns = limit_ns;
	conduct();
	unlock();
}

int64_t clock_virtual_limit(void)
{
	lock();
	int64_t limit_ns = conductor.limit_ns;
	unlock();
	return limit_ns;
}

bool clock_virtual_at_limit(void)
{
	lock();
	bool at_limit = conductor.busy_count == 0 && conductor.hold_count == 0 &&
			atomic_load(&now_ns) >= conductor.limit_ns;
	unlock();
	return at_limit;
}
