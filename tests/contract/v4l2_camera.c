#include "tests/contract/v4l2_camera.h"

const struct camera_driver *const driver = &v4l2_camera_driver;
const struct camera_mode grey = {.format = PIXEL_GREY8};

int v4l2_set_up(void **state)
{
	(void)state;
	fake_v4l2_begin();
	return 0;
}

int v4l2_tear_down(void **state)
{
	one_camera_tear_down(state);
	fake_v4l2_end();
	return 0;
}

void begin(const char *settings, const struct camera_mode *wanted)
{
	fake_v4l2_plug(0, "A1", settings);
	start_camera("/dev/video0", wanted);
}
