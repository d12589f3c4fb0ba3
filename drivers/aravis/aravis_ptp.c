/*
 * GenICam's names for PTP are those of SFNC 2.3, or older ones.
 */
#include "drivers/aravis/aravis_ptp.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "base/clock.h"
#include "drivers/aravis/aravis_device.h"

#define OFF_MAX_NS NS_PER_MS /* beyond what a reading leaves open: another master, or none */
#define DRIFT_PPM 200        /* of a clock that nobody keeps any more */
#define TRIES 2
#define LOOKS 5

static const struct {
	const char *enable, *status, *latch;
} features[] = {
	{"PtpEnable", "PtpStatus", "PtpDataSetLatch"},
	{"GevIEEE1588", "GevIEEE1588Status", "GevIEEE1588DataSetLatch"},
};

#define FEATURE_COUNT (sizeof(features) / sizeof(features[0]))

enum { STATUS_NOT_TOLD, STATUS_OTHER, STATUS_SLAVE, STATUS_MASTER, STATUS_LISTENING, STATUS_COUNT };

static const char *const status_names[STATUS_COUNT] = {"", "not ready", "Slave", "Master",
						       "Listening"};

static bool has(ArvDevice *device, const char *feature)
{
	return arv_device_is_feature_available(device, feature, NULL);
}

void aravis_ptp_set(struct aravis_ptp *ptp, ArvCamera *device, enum camera_clock wanted)
{
	ArvDevice *of = arv_camera_get_device(device);

	ptp->device = device;
	ptp->wanted = wanted == CAMERA_CLOCK_PTP;
	ptp->on = false;
	ptp->usable = false;
	for (size_t f = 0; f < FEATURE_COUNT; f++) {
		GError *error = NULL;

		if (!has(of, features[f].enable))
			continue;
		bool is_on = arv_device_get_boolean_feature_value(of, features[f].enable, &error);

		if (!error && is_on != ptp->wanted) /* said twice it may begin to listen anew */
			arv_device_set_boolean_feature_value(of, features[f].enable, ptp->wanted,
							     &error);
		ptp->on |= ptp->wanted && !error;
		g_clear_error(&error);
	}
}

static int read_status(ArvDevice *device)
{
	for (size_t f = 0; f < FEATURE_COUNT; f++) {
		if (!has(device, features[f].status))
			continue;
		if (has(device, features[f].latch))
			arv_device_execute_command(device, features[f].latch, NULL);
		const char *name =
			arv_device_get_string_feature_value(device, features[f].status, NULL);

		for (int s = STATUS_SLAVE; name && s < STATUS_COUNT; s++)
			if (strcmp(name, status_names[s]) == 0)
				return s;
		return name ? STATUS_OTHER : STATUS_NOT_TOLD;
	}
	return STATUS_NOT_TOLD;
}

/* How far CLOCK_TAI is ahead of CLOCK_MONOTONIC, by the sharpest of a few looks. */
static int64_t tai_ahead_ns(int64_t *bound_ns)
{
	int64_t ahead_ns = 0;

	*bound_ns = INT64_MAX;
	for (int i = 0; i < LOOKS; i++) {
		struct timespec tai;
		int64_t before_ns = clock_now_ns();

		clock_gettime(CLOCK_TAI, &tai);
		int64_t half_ns = (clock_now_ns() - before_ns) / 2;

		if (half_ns < *bound_ns) {
			*bound_ns = half_ns + 1;
			ahead_ns = tai.tv_sec * NS_PER_S + tai.tv_nsec - before_ns - half_ns;
		}
	}
	return ahead_ns;
}

static int64_t grown_ns(int64_t bound_ns, int64_t age_ns)
{
	return bound_ns + llabs(age_ns) * DRIFT_PPM / 1000000;
}

/* A blunt reading proves less than a sharp one that is older. */
static void publish(struct aravis_ptp *ptp, int64_t ahead_ns, int64_t bound_ns, int64_t read_ns)
{
	if (ptp->usable && ptp->ahead_ns / NS_PER_MS == ahead_ns / NS_PER_MS &&
	    bound_ns > grown_ns(ptp->bound_ns, read_ns - ptp->read_ns))
		return;
	atomic_fetch_add(&ptp->change, 1);
	ptp->ahead_ns = ahead_ns;
	ptp->bound_ns = bound_ns;
	ptp->read_ns = read_ns;
	atomic_fetch_add(&ptp->change, 1);
}

void aravis_ptp_look(struct aravis_ptp *ptp)
{
	struct device_clock reading;

	if (!ptp->on)
		return;
	int64_t bound_ns, ahead_ns = tai_ahead_ns(&bound_ns);
	int error = aravis_read_clock(ptp->device, TRIES, &reading);

	ptp->error = error;
	if (error) {
		ptp->usable = false;
		return;
	}
	int64_t off_ns = reading.device_ns - reading.host_ns - ahead_ns;
	int status = read_status(arv_camera_get_device(ptp->device));

	ptp->off_ns = off_ns;
	ptp->status = status;
	if (llabs(off_ns) > reading.bound_ns + OFF_MAX_NS ||
	    (status != STATUS_SLAVE && status != STATUS_MASTER && status != STATUS_NOT_TOLD)) {
		ptp->usable = false;
		return;
	}
	publish(ptp, ahead_ns, llabs(off_ns) + reading.bound_ns + bound_ns, reading.host_ns);
	ptp->usable = true;
}

bool aravis_ptp_host_ns(const struct aravis_ptp *ptp, int64_t device_ns, int64_t *host_ns,
			int64_t *bound_ns)
{
	uint32_t change = atomic_load(&ptp->change);

	if (!ptp->usable || change % 2)
		return false;
	int64_t at_ns = device_ns - ptp->ahead_ns;
	int64_t within_ns = grown_ns(ptp->bound_ns, at_ns - ptp->read_ns);

	if (atomic_load(&ptp->change) != change)
		return false;
	*host_ns = at_ns;
	*bound_ns = within_ns;
	return true;
}

void aravis_ptp_tell(const struct aravis_ptp *ptp, struct camera_fact *out)
{
	double off_s = (double)ptp->off_ns / NS_PER_S;

	*out = (struct camera_fact){.name = "clock", .falls_short = ptp->wanted && !ptp->usable};
	if (ptp->usable)
		snprintf(out->text, sizeof(out->text), "PTP %s, as CLOCK_TAI to %.0f us",
			 status_names[ptp->status], (double)ptp->bound_ns / NS_PER_US);
	else if (!ptp->wanted)
		strcpy(out->text, "its own, mapped");
	else if (!ptp->on)
		strcpy(out->text,
		       "its own, mapped: the camera has no PTP (PtpEnable, GevIEEE1588)");
	else if (ptp->error)
		strcpy(out->text, "its own, mapped: PTP is on, but its clock cannot be read");
	else
		snprintf(out->text, sizeof(out->text),
			 "its own, mapped: PTP %s, %+.6f s from CLOCK_TAI: look after ptp4l and "
			 "phc2sys",
			 status_names[ptp->status], off_s);
}
