/*
 * An emulated FT232H: bit_bang [options]. It takes packets while its memory of 1024 bytes has room
 * and puts them out by a clock of its own, as the chip does in bit-bang mode. What it does is
 * written to a trace; lines of a GPIO chip can follow its D5, D6 and D7. To end it is to unplug it.
 */
#include <errno.h>
#include <fcntl.h>
#include <getopt.h>
#include <pthread.h>
#include <sched.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "base/clock.h"
#include "base/ring.h"
#include "drivers/gpio/gpio_find.h"
#include "tests/hil/bit_bang.h"
#include "tests/hil/usb_device.h"

#define FIFO_BYTES 1024
#define PACKET_BYTES 512
/* The kernel's simulated bus moves packets once a millisecond, which may be longer than the memory
 * lasts: a packet that comes no later is put out as if it had come in time. */
#define GRACE_NS (3 * NS_PER_MS)
#define CHANGES_MAX 4096
#define FIRST_LINE 5 /* D5 */
#define LINES_MAX 3
#define REQUEST_BAUD 3
#define REQUEST_MODE 11
#define LIT_FOREVER_NS (3600 * NS_PER_S)

static struct options {
	unsigned int bus, product, release;
	const char *serial, *trace, *chip;
	char *lines;
	double ppm;
} options = {.product = 0x6014, .release = 0x0900, .serial = "EMU0"};

/* Set on the lines at a time. */
struct change {
	int64_t time_ns;
	uint32_t levels;
};

static struct adapter {
	int fd, endpoint, trace_fd;
	struct gpio_outputs *outputs;
	struct ring changes;
	struct clock_semaphore changed;
	pthread_mutex_t lock; /* of what follows */
	uint32_t divisor;
	uint8_t mask, last;
	int64_t taken;                  /* samples */
	int64_t begin_ns, begin_sample; /* of samples without a gap */
} adapter = {.endpoint = -1, .trace_fd = -1, .lock = PTHREAD_MUTEX_INITIALIZER, .divisor = 60};

static const struct usb_endpoint_descriptor endpoint = {.bLength = USB_DT_ENDPOINT_SIZE,
							.bDescriptorType = USB_DT_ENDPOINT,
							.bEndpointAddress = 0x02,
							.bmAttributes = USB_ENDPOINT_XFER_BULK,
							.wMaxPacketSize = PACKET_BYTES};

/* When a sample is on the lines. */
static int64_t time_of(int64_t sample)
{
	double sample_ns = (double)adapter.divisor * 50 / 3 / (1 + options.ppm * 1e-6);

	return adapter.begin_ns + (int64_t)((double)(sample - adapter.begin_sample) * sample_ns);
}

static void note(enum bit_bang_kind kind, int64_t sample, uint32_t levels)
{
	const struct bit_bang_record record = {sample, time_of(sample), kind, levels};

	if (adapter.trace_fd >= 0 &&
	    write(adapter.trace_fd, &record, sizeof(record)) != sizeof(record))
		perror("trace");
}

static void change_lines(int64_t sample, uint32_t levels)
{
	struct change *slot = adapter.outputs ? ring_claim(&adapter.changes) : NULL;

	note(BIT_BANG_LINES, sample, levels);
	if (!slot)
		return;
	*slot = (struct change){time_of(sample), levels};
	ring_publish(&adapter.changes);
	clock_semaphore_post(&adapter.changed);
}

/* Whether the driver had nothing on its way. */
static bool is_dry(int64_t now_ns)
{
	int64_t dry_ns = time_of(adapter.taken);

	return now_ns >= dry_ns + (adapter.taken == adapter.begin_sample ? 0 : GRACE_NS);
}

static void put_out(const uint8_t *bytes, int count, int64_t now_ns)
{
	if (is_dry(now_ns)) {
		adapter.begin_ns = now_ns;
		adapter.begin_sample = adapter.taken;
		note(BIT_BANG_BEGIN, adapter.taken, adapter.last & adapter.mask);
	}
	for (int i = 0; i < count; i++) {
		if ((bytes[i] ^ adapter.last) & adapter.mask)
			change_lines(adapter.taken + i, bytes[i] & adapter.mask);
		adapter.last = bytes[i];
	}
	adapter.taken += count;
	if (adapter.last & adapter.mask)
		note(BIT_BANG_LIT, adapter.taken, adapter.last & adapter.mask);
}

/* Takes a packet when there is room for one. */
static void *take(void *unused)
{
	uint8_t packet[PACKET_BYTES];

	for (;;) {
		pthread_mutex_lock(&adapter.lock);
		int64_t room_ns = time_of(adapter.taken - (FIFO_BYTES - PACKET_BYTES));

		pthread_mutex_unlock(&adapter.lock);
		clock_sleep_until(room_ns);
		int count = usb_device_take(adapter.fd, adapter.endpoint, packet, sizeof(packet));
		int64_t now_ns = clock_now_ns();

		if (count < 0)
			clock_sleep_until(now_ns + NS_PER_MS); /* not configured yet, or anew */
		pthread_mutex_lock(&adapter.lock);
		if (count > 0)
			put_out(packet, count, now_ns);
		pthread_mutex_unlock(&adapter.lock);
	}
	return unused;
}

/* The lines of the GPIO chip follow. */
static void *follow(void *unused)
{
	for (;;) {
		const struct change *change = ring_peek(&adapter.changes, 0);

		if (!change) {
			clock_semaphore_wait(&adapter.changed, clock_now_ns() + LIT_FOREVER_NS);
			continue;
		}
		clock_sleep_until(change->time_ns);
		gpio_outputs_set(adapter.outputs, change->levels >> FIRST_LINE);
		ring_pop(&adapter.changes);
	}
	return unused;
}

static int configured(void *unused)
{
	pthread_t thread;

	(void)unused;
	if (adapter.endpoint >= 0)
		return 0;
	adapter.endpoint = usb_device_enable(adapter.fd, &endpoint);
	if (adapter.endpoint < 0)
		return adapter.endpoint;
	return -pthread_create(&thread, NULL, take, NULL);
}

static void set_clock(uint32_t divisor)
{
	adapter.divisor = divisor ? divisor : 1;
	adapter.begin_ns = clock_now_ns();
	adapter.begin_sample = adapter.taken;
}

static void set_mode(uint16_t value)
{
	uint8_t was = adapter.last & adapter.mask;

	adapter.mask = value >> 8 == 1 ? (uint8_t)value : 0;
	if ((adapter.last & adapter.mask) != was)
		change_lines(adapter.taken, adapter.last & adapter.mask);
}

static int answer(const struct usb_ctrlrequest *request)
{
	uint8_t zeros[64] = {0};

	if (request->bRequestType & USB_DIR_IN)
		return usb_device_reply(adapter.fd, request, zeros, sizeof(zeros));
	pthread_mutex_lock(&adapter.lock);
	if (request->bRequest == REQUEST_BAUD && request->wIndex >> 8 == 2)
		set_clock(request->wValue & 0x3fff);
	if (request->bRequest == REQUEST_MODE)
		set_mode(request->wValue);
	pthread_mutex_unlock(&adapter.lock);
	return usb_device_receive(adapter.fd, request, zeros, sizeof(zeros));
}

/* One interface of the vendor's own with an endpoint each way. */
static size_t describe(uint8_t *out)
{
	const struct usb_config_descriptor config = {.bLength = USB_DT_CONFIG_SIZE,
						     .bDescriptorType = USB_DT_CONFIG,
						     .wTotalLength = USB_DT_CONFIG_SIZE +
								     USB_DT_INTERFACE_SIZE +
								     2 * USB_DT_ENDPOINT_SIZE,
						     .bNumInterfaces = 1,
						     .bConfigurationValue = 1,
						     .bmAttributes = USB_CONFIG_ATT_ONE,
						     .bMaxPower = 45};
	const struct usb_interface_descriptor interface = {.bLength = USB_DT_INTERFACE_SIZE,
							   .bDescriptorType = USB_DT_INTERFACE,
							   .bNumEndpoints = 2,
							   .bInterfaceClass = USB_CLASS_VENDOR_SPEC,
							   .bInterfaceSubClass = 0xff,
							   .bInterfaceProtocol = 0xff};
	struct usb_endpoint_descriptor in = endpoint;
	uint8_t *at = out;

	in.bEndpointAddress = 0x81;
	at = mempcpy(at, &config, USB_DT_CONFIG_SIZE);
	at = mempcpy(at, &interface, USB_DT_INTERFACE_SIZE);
	at = mempcpy(at, &in, USB_DT_ENDPOINT_SIZE);
	at = mempcpy(at, &endpoint, USB_DT_ENDPOINT_SIZE);
	return (size_t)(at - out);
}

static int serve(void)
{
	const char *const strings[] = {"FTDI", "FT232H emulated", options.serial, NULL};
	uint8_t configuration[64];
	const struct usb_descriptors descriptors = {
		.device = {.bLength = USB_DT_DEVICE_SIZE,
			   .bDescriptorType = USB_DT_DEVICE,
			   .bcdUSB = 0x0200,
			   .bMaxPacketSize0 = 64,
			   .idVendor = 0x0403,
			   .idProduct = (uint16_t)options.product,
			   .bcdDevice = (uint16_t)options.release,
			   .iManufacturer = 1,
			   .iProduct = 2,
			   .iSerialNumber = *options.serial ? 3 : 0,
			   .bNumConfigurations = 1},
		.configuration = configuration,
		.configuration_bytes = describe(configuration),
		.strings = strings};
	struct usb_ctrlrequest request;

	for (;;) {
		int err = usb_device_next_request(adapter.fd, &request);

		if (err)
			return err;
		int answered = usb_device_answer_standard(adapter.fd, &request, &descriptors,
							  configured, NULL);

		if (answered == 0)
			err = answer(&request);
		if (err < 0 || answered < 0)
			fprintf(stderr, "request %02x %02x: %s\n", request.bRequestType,
				request.bRequest, strerror(-(err ? err : answered)));
	}
}

static int open_lines(void)
{
	uint32_t offsets[LINES_MAX], count = 0;
	struct diag diag = {0};
	struct gpio_chip *chip;
	pthread_t thread;
	int err = gpio_find_chip(&chip, options.chip, "bit_bang", &diag);

	for (char *name = strtok(options.lines, ","); !err && name && count < LINES_MAX;
	     name = strtok(NULL, ","))
		err = gpio_find_line(chip, name, &offsets[count++], "bit_bang", &diag);
	if (!err)
		err = gpio_outputs_request(&adapter.outputs, chip, "bit_bang", offsets, count, 0);
	diag_print(&diag, stderr);
	if (!err)
		err = ring_init(&adapter.changes, sizeof(struct change), CHANGES_MAX);
	clock_semaphore_init(&adapter.changed);
	return err ? err : -pthread_create(&thread, NULL, follow, NULL);
}

static int run(void)
{
	struct sched_param param = {.sched_priority = 90};
	int err = 0;

	mlockall(MCL_CURRENT | MCL_FUTURE);
	sched_setscheduler(0, SCHED_FIFO, &param);
	if (options.trace)
		adapter.trace_fd = open(options.trace, O_WRONLY | O_APPEND | O_CREAT, 0600);
	if (options.chip)
		err = open_lines();
	if (!err)
		err = usb_device_open(&adapter.fd, options.bus);
	return err ? err : serve();
}

static bool parse(int argc, char **argv)
{
	static const struct option known[] = {
		{"bus", 1, NULL, 'b'},   {"serial", 1, NULL, 's'},  {"product", 1, NULL, 'p'},
		{"trace", 1, NULL, 't'}, {"release", 1, NULL, 'r'}, {"ppm", 1, NULL, 'm'},
		{"chip", 1, NULL, 'c'},  {"lines", 1, NULL, 'l'},   {0},
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
			options.product = (unsigned int)strtoul(optarg, NULL, 16);
			break;
		case 'r':
			options.release = (unsigned int)strtoul(optarg, NULL, 16);
			break;
		case 't':
			options.trace = optarg;
			break;
		case 'm':
			options.ppm = atof(optarg);
			break;
		case 'c':
			options.chip = optarg;
			break;
		case 'l':
			options.lines = optarg;
			break;
		default:
			return false;
		}
	return optind == argc && !options.chip == !options.lines;
}

int main(int argc, char **argv)
{
	if (!parse(argc, argv)) {
		fprintf(stderr,
			"usage: %s [--bus N] [--serial TEXT] [--product HEX] [--release HEX]\n"
			"       [--ppm DRIFT] [--trace FILE] [--chip CHIP --lines IR,STROBE,HD]\n",
			argv[0]);
		return EXIT_FAILURE;
	}
	int err = run();

	fprintf(stderr, "%s: %s\n", argv[0], strerror(-err));
	return EXIT_FAILURE;
}
