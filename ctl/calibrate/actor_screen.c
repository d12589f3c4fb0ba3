/*
 * Keys are read one by one, without the terminal's showing them.
 */
#include "ctl/calibrate/actor_screen.h"

#include <ctype.h>
#include <poll.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#include "base/clock.h"

#define BAR_CELLS 32
#define DRAW_NS (NS_PER_S / 10)

void actor_screen_begin(struct actor_screen *screen, bool json)
{
	struct termios quiet;

	memset(screen, 0, sizeof(*screen));
	screen->kind = json ? SCREEN_JSON : SCREEN_PLAIN;
	if (json || !isatty(STDIN_FILENO) || !isatty(STDOUT_FILENO) ||
	    tcgetattr(STDIN_FILENO, &screen->before) < 0)
		return;
	quiet = screen->before;
	quiet.c_lflag &= ~(tcflag_t)(ICANON | ECHO); /* Ctrl-C stays a signal */
	screen->raw = tcsetattr(STDIN_FILENO, TCSANOW, &quiet) == 0;
	screen->kind = SCREEN_TERMINAL;
}

static void end_changing(struct actor_screen *screen)
{
	if (screen->changing)
		fputs("\r\033[K", stdout);
	screen->changing = false;
}

void actor_screen_finish(struct actor_screen *screen)
{
	end_changing(screen);
	fflush(stdout);
	if (screen->raw)
		tcsetattr(STDIN_FILENO, TCSANOW, &screen->before);
	screen->raw = false;
}

int actor_screen_key(const struct actor_screen *screen)
{
	struct pollfd in = {.fd = STDIN_FILENO, .events = POLLIN};
	char key;

	if (screen->kind != SCREEN_TERMINAL || poll(&in, 1, 0) <= 0 ||
	    read(STDIN_FILENO, &key, 1) != 1)
		return 0;
	return tolower((unsigned char)key);
}

void actor_screen_say(struct actor_screen *screen, json_t *facts, const char *format, ...)
{
	va_list arguments;

	end_changing(screen);
	if (screen->kind == SCREEN_JSON) {
		json_dumpf(facts, stdout, JSON_COMPACT | JSON_REAL_PRECISION(6));
	} else {
		va_start(arguments, format);
		vprintf(format, arguments);
		va_end(arguments);
	}
	putchar('\n');
	fflush(stdout);
	json_decref(facts);
}

void actor_screen_show(struct actor_screen *screen, int done, int count, const char *format, ...)
{
	int64_t now_ns = clock_now_ns();
	va_list arguments;

	if (screen->kind != SCREEN_TERMINAL || now_ns - screen->drawn_ns < DRAW_NS)
		return;
	screen->drawn_ns = now_ns;
	screen->changing = true;
	fputs("\r\033[K[", stdout);
	for (int k = 0; k < BAR_CELLS; k++)
		putchar(k * count < done * BAR_CELLS ? '#' : '.');
	printf("] %2d/%d  ", done, count);
	va_start(arguments, format);
	vprintf(format, arguments);
	va_end(arguments);
	fflush(stdout);
}
