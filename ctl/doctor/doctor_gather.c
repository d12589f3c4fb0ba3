/*
 * Asks the kernel, by calls.
 */
#include "ctl/doctor/doctor_gather.h"

#include <linux/capability.h>
#include <pwd.h>
#include <stdio.h>
#include <sys/resource.h>
#include <sys/timex.h>
#include <unistd.h>

#include "base/clock.h"

#define CLOCK_READS 10000
#define USUAL_TICK_US 10000 /* a hundredth of a second; NTP may make it longer or shorter */

static void gather_asker(struct person *asker)
{
	const struct passwd *user = getpwuid(getuid());
	int count = getgroups(PERSON_GROUP_MAX - 1, asker->gids);

	asker->uid = getuid();
	asker->gid_count = count > 0 ? (uint32_t)count : 0;
	asker->gids[asker->gid_count++] = getgid();
	if (user)
		snprintf(asker->name, sizeof(asker->name), "%s", user->pw_name);
	else
		snprintf(asker->name, sizeof(asker->name), "user %u", asker->uid);
}

/* Whoever has the capability is bound by no limit; containers take it even from root. */
static bool has_capability(int capability)
{
	FILE *file = fopen("/proc/self/status", "re");
	unsigned long long effective = 0;
	char line[256];

	while (file && fgets(line, sizeof(line), file))
		if (sscanf(line, "CapEff: %llx", &effective) == 1)
			break;
	if (file)
		fclose(file);
	return effective >> capability & 1;
}

static uint64_t limit_of(__rlimit_resource_t resource, int capability)
{
	struct rlimit limit;

	if (has_capability(capability))
		return UINT64_MAX;
	if (getrlimit(resource, &limit) < 0)
		return 0;
	return limit.rlim_cur == RLIM_INFINITY ? UINT64_MAX : limit.rlim_cur;
}

static double measure_reading_ns(void)
{
	int64_t begin_ns = clock_now_ns(), end_ns = begin_ns;

	for (int i = 0; i < CLOCK_READS; i++)
		end_ns = clock_now_ns();
	return (double)(end_ns - begin_ns) / CLOCK_READS;
}

static void gather_clock(struct doctor_facts *facts)
{
	struct timex state = {0};
	int result = adjtimex(&state);

	facts->clock_read_ns = measure_reading_ns();
	if (result < 0)
		return;
	facts->utc_synchronised = !(state.status & STA_UNSYNC) && result != TIME_ERROR;
	facts->clock_slew_ppm = (double)state.freq / 65536 +
				(double)(state.tick - USUAL_TICK_US) * 1e6 / USUAL_TICK_US;
}

void doctor_gather(struct doctor_facts *facts)
{
	gather_asker(&facts->asker);
	facts->rtprio_max = limit_of(RLIMIT_RTPRIO, CAP_SYS_NICE);
	facts->memlock_max_bytes = limit_of(RLIMIT_MEMLOCK, CAP_IPC_LOCK);
	gather_clock(facts);
}

/* HD images without a size in the config: not known. */
static void find_load(struct doctor_load *load, const struct stage *stage, uint32_t c)
{
	const struct config_camera *camera = &stage->config.cameras[c];
	int width_px = camera->wanted.width_px, height_px = camera->wanted.height_px;
	int64_t period_ns = stage->config.plan.period_ns;

	if (camera->role == ROLE_IR && stage->has_rig) {
		width_px = stage->rig.views[stage->view_index[c]].width_px;
		height_px = stage->rig.views[stage->view_index[c]].height_px;
	}
	if (camera->role == ROLE_HD)
		period_ns *= stage->config.plan.hd_divider;
	load->frame_bytes = pixel_row_bytes(camera->wanted.format, width_px) * (uint64_t)height_px;
	load->bytes_per_s = (double)load->frame_bytes * NS_PER_S / (double)period_ns;
}

void doctor_find_loads(struct doctor_load loads[CAMERA_MAX], const struct stage *stage)
{
	for (uint32_t c = 0; c < stage->config.camera_count; c++)
		find_load(&loads[c], stage, c);
}
