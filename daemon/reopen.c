/*
 * One attempt per errand.
 */
#include "daemon/reopen.h"

static void try_again(void *user)
{
	struct reopener *reopener = user;
	struct open_camera *device = &reopener->device;

	if (device->camera)
		device->driver->close(device->camera);
	device->camera = NULL;
	reopener->error =
		open_camera_by_config(device, reopener->stage, reopener->camera, reopener->drivers,
				      reopener->fires, &reopener->diag);
}

bool reopen_begin(struct reopener *reopener, const struct stage *stage,
		  const struct camera_driver *const *drivers, uint32_t fires, uint32_t index,
		  const struct open_camera *lost)
{
	if (reopener->errand.busy)
		return false;
	diag_finish(&reopener->diag);
	reopener->stage = stage;
	reopener->drivers = drivers;
	reopener->fires = fires;
	reopener->camera = index;
	reopener->device = *lost;
	return errand_begin(&reopener->errand, try_again, reopener);
}

bool reopen_poll(struct reopener *reopener)
{
	return errand_poll(&reopener->errand);
}

bool reopen_finish(struct reopener *reopener)
{
	bool busy = reopener->errand.busy;

	if (!errand_finish(&reopener->errand))
		return false;
	if (busy && reopener->error == 0)
		reopener->device.driver->close(reopener->device.camera);
	diag_finish(&reopener->diag);
	return true;
}
