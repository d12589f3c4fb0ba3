/*
 * An emulated USB camera: uvc_camera --bus N --serial TEXT --pictures DIR [options]. The kernel's
 * uvcvideo takes it for a real one. It runs by its own clock, or exposes on the pulses of a line;
 * to end it is to unplug it.
 */
#include <errno.h>
#include <getopt.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <linux/usb/video.h>

#include "base/clock.h"
#include "tests/hil/line_watch.h"
#include "tests/hil/pictures.h"
#include "tests/hil/usb_device.h"
#include "tests/hil/uvc_controls.h"
#include "tests/hil/uvc_descriptors.h"

#define NO_EXPOSURE UINT64_MAX
#define NS_PER_100NS 100
#define RATES_HZ          \
	{                 \
		30, 10, 5 \
	}

static struct options {
	unsigned int bus;
	const char *serial, *pictures, *gpio_device;
	unsigned int gpio_offset;
	uint64_t lose, damage; /* exposures that are not made, and that are cut short */
} options = {.serial = "1", .lose = NO_EXPOSURE, .damage = NO_EXPOSURE};

static struct camera {
	/* set before the thread starts */
	int fd;
	struct pictures pictures;
	struct uvc_mode mode;
	uint8_t configuration[512];
	struct usb_descriptors descriptors;
	struct line_watch trigger;
	pthread_t thread;
	/* control thread */
	int endpoint;
	uint8_t probe[UVC_PROBE_BYTES];
	/* exposing thread */
	bool lit; /* the trigger line */
	/* any thread */
	_Atomic uint32_t interval_100ns; /* 0: not streaming */
	_Atomic int64_t started_ns;
} camera = {.endpoint = -1};

/* What is on its way from before is thrown away: the signal ends the wait of the other thread. */
static void start_streaming(void)
{
	atomic_store(&camera.started_ns, clock_now_ns());
	atomic_store(&camera.interval_100ns, uvc_probe_interval(camera.probe));
	pthread_kill(camera.thread, SIGUSR1);
}

static int take_probe(const struct usb_ctrlrequest *request)
{
	uint8_t in[UVC_PROBE_BYTES] = {0};
	uint32_t granted = camera.mode.intervals_100ns[0];
	int err = usb_device_receive(camera.fd, request, in, sizeof(in));

	if (err)
		return err;
	for (int i = 0; i < camera.mode.interval_count; i++)
		if (camera.mode.intervals_100ns[i] == uvc_probe_interval(in))
			granted = uvc_probe_interval(in);
	uvc_fill_probe(&camera.mode, granted, camera.probe);
	if (request->wValue >> 8 == UVC_VS_COMMIT_CONTROL)
		start_streaming();
	return 0;
}

static int answer_streaming(const struct usb_ctrlrequest *request)
{
	uint8_t fastest[UVC_PROBE_BYTES];

	switch (request->bRequest) {
	case UVC_SET_CUR:
		return take_probe(request);
	case UVC_GET_CUR:
		return usb_device_reply(camera.fd, request, camera.probe, sizeof(camera.probe));
	case UVC_GET_MIN:
	case UVC_GET_MAX:
	case UVC_GET_DEF:
		uvc_fill_probe(&camera.mode, camera.mode.intervals_100ns[0], fastest);
		return usb_device_reply(camera.fd, request, fastest, sizeof(fastest));
	case UVC_GET_LEN:
		return uvc_reply_number(camera.fd, request, UVC_PROBE_BYTES, 2);
	case UVC_GET_INFO:
		return uvc_reply_number(camera.fd, request,
					UVC_CONTROL_CAP_GET | UVC_CONTROL_CAP_SET, 1);
	default:
		return usb_device_refuse(camera.fd);
	}
}

/* Waits for the next exposure, by the own clock or by a pulse, and tells its time; false: not yet.
 */
static bool wait_for_exposure(int64_t *next_ns)
{
	int64_t interval_ns = (int64_t)atomic_load(&camera.interval_100ns) * NS_PER_100NS;

	if (options.gpio_device) {
		struct line_change change = {0};
		int err = line_watch_next(&camera.trigger, 1000, &change);

		bool rises = !err && change.level && !camera.lit;

		camera.lit = err ? camera.lit : change.level;
		*next_ns = change.time_ns;
		if (!rises)
			return false;
		clock_sleep_until(change.time_ns + uvc_exposure_ns());
		return true;
	}
	if (interval_ns == 0)
		interval_ns = NS_PER_S / 10;
	if (*next_ns < clock_now_ns() - interval_ns)
		*next_ns = clock_now_ns();
	*next_ns += interval_ns;
	clock_sleep_until(*next_ns);
	return true;
}

/* One payload: two bytes of header, whose lowest bit changes from frame to frame, and the pixels.
 */
static void send_frame(uint8_t *payload, uint64_t exposure, bool odd)
{
	size_t pixels = (size_t)camera.mode.width_px * camera.mode.height_px;

	payload[0] = UVC_PAYLOAD_HEADER_BYTES;
	payload[1] = UVC_STREAM_EOH | UVC_STREAM_EOF | (odd ? UVC_STREAM_FID : 0);
	memcpy(payload + UVC_PAYLOAD_HEADER_BYTES, pictures_get(&camera.pictures, exposure),
	       pixels);
	if (exposure == options.damage)
		pixels /= 2;
	usb_device_send(camera.fd, camera.endpoint, payload, UVC_PAYLOAD_HEADER_BYTES + pixels);
}

static void *expose(void *unused)
{
	uint8_t *payload = malloc(UVC_PAYLOAD_HEADER_BYTES +
				  (size_t)camera.mode.width_px * camera.mode.height_px);
	int64_t next_ns = clock_now_ns();
	uint64_t exposure = 0;
	bool odd = false;

	while (payload) {
		if (!wait_for_exposure(&next_ns))
			continue;
		if (exposure != options.lose && atomic_load(&camera.interval_100ns) &&
		    next_ns >= atomic_load(&camera.started_ns)) {
			send_frame(payload, exposure, odd);
			odd = !odd;
		}
		exposure++;
	}
	return unused;
}

static int configured(void *unused)
{
	(void)unused;
	if (camera.endpoint < 0)
		camera.endpoint = usb_device_enable(camera.fd, &uvc_endpoint);
	return camera.endpoint < 0 ? camera.endpoint : 0;
}

static int serve(void)
{
	struct usb_ctrlrequest request;

	for (;;) {
		int err = usb_device_next_request(camera.fd, &request);

		if (err)
			return err;
		int answered = usb_device_answer_standard(camera.fd, &request, &camera.descriptors,
							  configured, NULL);

		if (answered == 0 && (request.wIndex & 0xff) == UVC_VIDEO_STREAMING)
			err = answer_streaming(&request);
		else if (answered == 0)
			err = uvc_answer_control(camera.fd, &request);
		if (err < 0 || answered < 0)
			fprintf(stderr, "request %02x %02x: %s\n", request.bRequestType,
				request.bRequest, strerror(-(err ? err : answered)));
	}
}

static void describe(void)
{
	static const char *strings[] = {"stage", "emulated camera", NULL, NULL};
	static const uint32_t rates_hz[UVC_INTERVALS_MAX] = RATES_HZ;

	strings[2] = options.serial;
	camera.mode = (struct uvc_mode){.width_px = (uint16_t)camera.pictures.width_px,
					.height_px = (uint16_t)camera.pictures.height_px,
					.interval_count = UVC_INTERVALS_MAX};
	for (int i = 0; i < UVC_INTERVALS_MAX; i++)
		camera.mode.intervals_100ns[i] = 10000000 / rates_hz[i];
	uvc_fill_probe(&camera.mode, camera.mode.intervals_100ns[0], camera.probe);
	camera.descriptors = (struct usb_descriptors){
		.device = {.bLength = USB_DT_DEVICE_SIZE,
			   .bDescriptorType = USB_DT_DEVICE,
			   .bcdUSB = 0x0200,
			   .bDeviceClass = USB_CLASS_MISC,
			   .bDeviceSubClass = 2,
			   .bDeviceProtocol = 1,
			   .bMaxPacketSize0 = 64,
			   .idVendor = 0x1209, /* pid.codes, for tests in private */
			   .idProduct = 0x0001,
			   .iManufacturer = 1,
			   .iProduct = 2,
			   .iSerialNumber = 3,
			   .bNumConfigurations = 1},
		.configuration = camera.configuration,
		.configuration_bytes = uvc_describe(&camera.mode, camera.configuration),
		.strings = strings};
}

static void interrupt_the_wait(int signal_number)
{
	(void)signal_number;
}

static int run(void)
{
	struct sigaction action = {.sa_handler = interrupt_the_wait};
	int err = pictures_load(&camera.pictures, options.pictures);

	if (!err && options.gpio_device)
		err = line_watch_open(&camera.trigger, options.gpio_device, options.gpio_offset);
	if (err)
		return err;
	sigaction(SIGUSR1, &action, NULL);
	describe();
	err = usb_device_open(&camera.fd, options.bus);
	if (!err)
		err = -pthread_create(&camera.thread, NULL, expose, NULL);
	return err ? err : serve();
}

static bool parse(int argc, char **argv)
{
	static const struct option known[] = {
		{"bus", 1, NULL, 'b'},      {"serial", 1, NULL, 's'},
		{"pictures", 1, NULL, 'p'}, {"gpio", 1, NULL, 'g'},
		{"line", 1, NULL, 'l'},     {"lose", 1, NULL, 'o'},
		{"damage", 1, NULL, 'd'},   {0},
	};

	for (int c; (c = getopt_long(argc, argv, "", known, NULL)) != -1;)
		switch (c) {
		case 'b':
			options.bus = (unsigned int)atoi(optarg);
			break;
		case 's':
			options.serial = optarg;
			break;
		case 'p':
			options.pictures = optarg;
			break;
		case 'g':
			options.gpio_device = optarg;
			break;
		case 'l':
			options.gpio_offset = (unsigned int)atoi(optarg);
			break;
		case 'o':
			options.lose = strtoull(optarg, NULL, 10);
			break;
		case 'd':
			options.damage = strtoull(optarg, NULL, 10);
			break;
		default:
			return false;
		}
	return options.pictures && optind == argc;
}

int main(int argc, char **argv)
{
	if (!parse(argc, argv)) {
		fprintf(stderr,
			"usage: %s --pictures DIR [--bus N] [--serial TEXT]\n"
			"       [--gpio DEVICE-DIR --line OFFSET] [--lose EXPOSURE] [--damage "
			"EXPOSURE]\n",
			argv[0]);
		return EXIT_FAILURE;
	}
	int err = run();

	fprintf(stderr, "%s: %s\n", argv[0], strerror(-err));
	return EXIT_FAILURE;
}
