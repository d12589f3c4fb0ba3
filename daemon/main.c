/*
 * staged: the motion-capture station. Loads the stage, opens the devices, runs until it is told to
 * stop. On any error it says everything that is wrong and leaves nothing behind.
 */
#include <errno.h>
#include <getopt.h>
#include <malloc.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/stat.h>
#include <systemd/sd-daemon.h>
#include <systemd/sd-event.h>
#include <unistd.h>

#include "base/clock_virtual.h"
#include "base/exit_codes.h"
#include "base/log.h"
#include "daemon/accounts.h"
#include "daemon/control/control.h"
#include "daemon/darken.h"
#include "daemon/journal.h"
#include "daemon/listen.h"
#include "daemon/server.h"
#include "daemon/station.h"
#include "daemon/watchdog.h"

struct program {
	const char *config_path;
	const char *socket_dir; /* of the command line, or NULL */
	bool check, darken;
	bool idle; /* stay configured until an operator says start */
	struct station station;
	struct stream_statistics accounts;
	struct stream_description description;
	char rig_revision[sizeof(((struct rig *)0)->revision)]; /* the description's */
	sd_event *event;
	struct clock_alarm tick;
	int64_t tick_ns; /* when the next tick is due */
	struct watchdog watchdog;
	struct server *server;
	struct control *control;
};

static void print_help(void)
{
	puts("Usage: staged --config FILE [--socket-dir DIR] [--idle | --check | --darken]\n"
	     "Runs a motion-capture station until SIGTERM, SIGINT or SIGHUP.\n\nOptions:\n"
	     "  --config FILE      the stage: rig, layout, cameras\n"
	     "  --socket-dir DIR   where stream.sock and control.sock go (default: socket_dir of "
	     "the config)\n"
	     "  --idle             open and check everything, then wait for stagectl start\n"
	     "  --check            open and check everything, then exit\n"
	     "  --darken           switch the strobes of a station that was killed off, then "
	     "exit\n"
	     "  --version\n  --help             this text\n");
	exit_codes_print(stdout);
}

/* Negative: go on; else the exit code. */
static int parse_arguments(struct program *program, int argc, char **argv)
{
	static const struct option options[] = {
		{"config", required_argument, NULL, 'c'},
		{"socket-dir", required_argument, NULL, 's'},
		{"idle", no_argument, NULL, 'i'},
		{"check", no_argument, NULL, 'k'},
		{"darken", no_argument, NULL, 'd'},
		{"version", no_argument, NULL, 'v'},
		{"help", no_argument, NULL, 'h'},
		{0},
	};
	int chosen;

	while ((chosen = getopt_long(argc, argv, "h", options, NULL)) != -1) {
		if (chosen == 'c')
			program->config_path = optarg;
		else if (chosen == 's')
			program->socket_dir = optarg;
		else if (chosen == 'i')
			program->idle = true;
		else if (chosen == 'k')
			program->check = true;
		else if (chosen == 'd')
			program->darken = true;
		else if (chosen == 'v')
			return puts("staged " STAGE_VERSION), EXIT_CODE_OK;
		else if (chosen == 'h')
			return print_help(), EXIT_CODE_OK;
		else
			return EXIT_CODE_USAGE;
	}
	if (program->config_path && optind == argc &&
	    program->idle + program->check + program->darken <= 1)
		return -1;
	fputs("usage: staged --config FILE [--socket-dir DIR] [--idle | --check | --darken]; see "
	      "staged "
	      "--help\n",
	      stderr);
	return EXIT_CODE_USAGE;
}

static int make_socket_dir(const char *dir, struct diag *diag)
{
	struct stat st;

	if (mkdir(dir, 0755) < 0 && errno != EEXIST) {
		diag_add(diag,
			 "%s: cannot create the directory for the sockets: %s; name another one "
			 "with --socket-dir or socket_dir in the config",
			 dir, strerror(errno));
		return -errno;
	}
	if (stat(dir, &st) < 0 || !S_ISDIR(st.st_mode)) {
		diag_add(diag,
			 "%s: is not a directory; name another one with --socket-dir or socket_dir "
			 "in the config",
			 dir);
		return -ENOTDIR;
	}
	return 0;
}

static void describe_stream(struct program *program)
{
	const struct stage *stage = &program->station.stage;
	struct stream_description *description = &program->description;

	strcpy(program->rig_revision, stage->rig.revision);
	*description = (struct stream_description){
		.station_version = STAGE_VERSION,
		.rig_revision = program->rig_revision,
		.rig_serial = 1,
		.run = 1,
		.period_ns = program->station.period_ns,
		.camera_count = stage->config.camera_count,
		.layout = &stage->layout,
	};
	for (uint32_t c = 0; c < stage->config.camera_count; c++) {
		const struct capture *capture = &program->station.captures[c];
		struct stream_camera *camera = &description->cameras[c];

		memcpy(camera->name, capture->name, sizeof(camera->name));
		camera->is_hd = capture->role == ROLE_HD;
		camera->width_px = (uint32_t)capture->device.granted.width_px;
		camera->height_px = (uint32_t)capture->device.granted.height_px;
	}
}

static const char *socket_dir(const struct program *program)
{
	return program->socket_dir ? program->socket_dir : program->station.stage.config.socket_dir;
}

/* Before any device is opened: the cameras and strobes may be those of the station that runs. */
static enum exit_code refuse_second_station(const struct program *program, struct diag *diag)
{
	char control_path[PATH_MAX + 16];

	snprintf(control_path, sizeof(control_path), "%s/control.sock", socket_dir(program));
	return exit_code_of(listen_check(control_path, diag), EXIT_CODE_CONNECTION);
}

static enum exit_code prepare(struct program *program, struct diag *diag)
{
	enum exit_code code = station_load(&program->station, program->config_path, diag);

	if (code == EXIT_CODE_OK && !program->idle && !program->station.stage.has_rig) {
		diag_add(diag, STATION_NO_RIG, program->station.stage.config.rig_dir);
		code = EXIT_CODE_BAD_INPUT;
	}
	if (code == EXIT_CODE_OK && !program->check)
		code = refuse_second_station(program, diag);
	return code == EXIT_CODE_OK ? station_configure(&program->station, diag) : code;
}

/* The control socket first: two that start at once are told apart by it. */
static enum exit_code open_sockets(struct program *program, struct diag *diag)
{
	const char *dir = socket_dir(program);
	char control_path[PATH_MAX + 16], stream_path[PATH_MAX + 16];
	struct peer_rules rules = peer_rules_of_this_machine();
	int err = make_socket_dir(dir, diag);

	if (err)
		return EXIT_CODE_CONNECTION;
	snprintf(control_path, sizeof(control_path), "%s/control.sock", dir);
	snprintf(stream_path, sizeof(stream_path), "%s/stream.sock", dir);
	describe_stream(program);
	err = control_create(&program->control, program->event, control_path, &program->station,
			     &rules, diag);
	if (!err)
		err = server_create(&program->server, program->event, stream_path,
				    &program->description, diag);
	if (!err)
		control_set_server(program->control, program->server);
	return exit_code_of(err, EXIT_CODE_CONNECTION);
}

/* Another run or another rig begins with this set: subscribers are told before they get it. */
static void describe_anew(struct program *program, const struct marker_set *set)
{
	struct stream_description *description = &program->description;

	if (set->rig_serial == description->rig_serial && set->run == description->run)
		return;
	description->rig_serial = set->rig_serial;
	description->run = set->run;
	snprintf(program->rig_revision, sizeof(program->rig_revision), "%s",
		 rig_swap_revision(&program->station.rig_swap, set->rig_serial));
	server_redescribe(program->server);
}

static void mind_subscribers(struct program *program)
{
	if (clock_is_virtual())
		virtual_time_mind_subscribers(&program->station.virtual_time,
					      server_has_backlog(program->server));
}

/* After anything else: a subscriber may have read, or gone. */
static int on_handled(sd_event_source *source, void *user)
{
	(void)source;
	mind_subscribers(user);
	return 0;
}

static int on_wake(sd_event_source *source, int fd, uint32_t events, void *user)
{
	struct program *program = user;
	const struct marker_set *set;
	eventfd_t ignored;

	(void)source;
	(void)events;
	eventfd_read(fd, &ignored);
	while ((set = station_next_set(&program->station))) {
		describe_anew(program, set);
		server_publish(program->server, set);
		mind_subscribers(program);
		station_pop_set(&program->station);
	}
	control_answer_waiting(program->control);
	return 0;
}

static void set_tick(struct program *program)
{
	program->tick_ns += NS_PER_S;
	clock_alarm_set(&program->tick, program->tick_ns);
}

static int on_tick(sd_event_source *source, int fd, uint32_t events, void *user)
{
	struct program *program = user;

	(void)source;
	(void)fd;
	(void)events;
	station_tick(&program->station);
	control_tick(program->control);
	station_accounts(&program->station, &program->accounts);
	server_publish_statistics(program->server, &program->accounts);
	set_tick(program);
	return 0;
}

/* What ends the station. Under nohup a terminal that goes does not: SIGHUP stays ignored. */
static void find_ends(sigset_t *ends)
{
	struct sigaction hang_up;

	sigemptyset(ends);
	sigaddset(ends, SIGTERM);
	sigaddset(ends, SIGINT);
	if (sigaction(SIGHUP, NULL, &hang_up) == 0 && hang_up.sa_handler != SIG_IGN)
		sigaddset(ends, SIGHUP);
}

static int end_on_signals(sd_event *event)
{
	sigset_t ends;
	int err = 0;

	find_ends(&ends);
	for (int number = 1; number < NSIG && err >= 0; number++)
		if (sigismember(&ends, number) == 1)
			err = sd_event_add_signal(event, NULL, number, NULL, NULL);
	return err;
}

/* Before the first thread, so that all inherit it: signals come through the event loop alone. */
static int make_event_loop(struct program *program)
{
	sigset_t signals;

	find_ends(&signals);
	sigprocmask(SIG_BLOCK, &signals, NULL);
	signal(SIGPIPE, SIG_IGN);
	return sd_event_default(&program->event);
}

static int watch_events(struct program *program)
{
	int err = sd_event_add_io(program->event, NULL, program->station.wake_fd, EPOLLIN, on_wake,
				  program);

	if (err >= 0)
		err = clock_alarm_open(&program->tick);
	if (err >= 0)
		err = sd_event_add_io(program->event, NULL, program->tick.fd, EPOLLIN, on_tick,
				      program);
	program->tick_ns = clock_now_ns();
	set_tick(program);
	if (err >= 0 && clock_is_virtual())
		err = sd_event_add_post(program->event, NULL, on_handled, program);
	if (err >= 0)
		err = end_on_signals(program->event);
	if (err >= 0)
		err = watchdog_start(&program->watchdog, program->event, &program->station);
	return err;
}

static enum exit_code run(struct program *program, struct diag *diag)
{
	enum exit_code code = open_sockets(program, diag);

	clock_hold(); /* until the first tick is set */
	if (code == EXIT_CODE_OK && !program->idle)
		code = station_start(&program->station, STATION_START, diag);
	if (code != EXIT_CODE_OK)
		return code;
	if (watch_events(program) < 0) {
		diag_add(diag, "cannot watch for events");
		return EXIT_CODE_INTERNAL;
	}
	clock_release();
	log_info("%s: %u cameras, rig %s", station_state_name(program->station.state),
		 program->station.stage.config.camera_count, program->station.stage.rig.revision);
	sd_notifyf(0, "READY=1\nSTATUS=%s", station_state_name(program->station.state));
	int result = sd_event_loop(program->event);
	sd_notify(0, "STOPPING=1");
	log_info("stopping");
	return result < 0 ? EXIT_CODE_INTERNAL : EXIT_CODE_OK;
}

/* False when something is still in use. */
static bool finish(struct program *program)
{
	control_destroy(program->control);
	server_destroy(program->server);
	bool finished = station_finish(&program->station);

	watchdog_stop(&program->watchdog);
	sd_event_unref(program->event);
	clock_alarm_close(&program->tick);
	return finished;
}

/* Frames and queues are mapped on their own and given back when freed, always: by itself malloc
 * raises the limit with the first one freed, and a camera that comes back would add to the heap. */
#define MAPPED_FROM_BYTES (256 * 1024)

int main(int argc, char **argv)
{
	static struct program program;
	struct diag diag = {0};
	int code = parse_arguments(&program, argc, argv);

	if (code >= 0)
		return code;
	mallopt(M_MMAP_THRESHOLD, MAPPED_FROM_BYTES);
	journal_begin();
	if (program.darken) {
		code = darken(program.config_path, &diag);
		diag_print(&diag, stderr);
		diag_finish(&diag);
		return code;
	}
	code = make_event_loop(&program) < 0 ? EXIT_CODE_INTERNAL : prepare(&program, &diag);
	if (code == EXIT_CODE_OK && program.check)
		puts("good");
	else if (code == EXIT_CODE_OK)
		code = run(&program, &diag);
	diag_print(&diag, stderr);
	diag_finish(&diag);
	if (finish(&program))
		return code;
	if (program.station.hung) {
		log_error("a thread hangs: leaving without it; strobes are dark");
		code = EXIT_CODE_DEVICE;
	}
	_exit(code);
}
