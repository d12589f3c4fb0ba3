/*
 * What the operator of a calibration sees and presses: a terminal with a line that keeps changing,
 * plain lines without one, or one JSON object an event.
 */
#pragma once

#include <jansson.h>
#include <stdbool.h>
#include <stdint.h>
#include <termios.h>

enum actor_screen_kind { SCREEN_TERMINAL, SCREEN_PLAIN, SCREEN_JSON };

struct actor_screen {
	enum actor_screen_kind kind;
	bool changing; /* the last line is one that keeps changing */
	int64_t drawn_ns;
	bool raw;
	struct termios before;
};

/* A terminal when standard input and output are one. */
void actor_screen_begin(struct actor_screen *screen, bool json);
void actor_screen_finish(struct actor_screen *screen);

/* A key pressed since the last call, as a small letter; 0 = none. Never waits. */
int actor_screen_key(const struct actor_screen *screen);

/* Says an event: `facts` (taken over) where JSON is wanted, else the text as a line. */
void actor_screen_say(struct actor_screen *screen, json_t *facts, const char *format, ...)
	__attribute__((format(printf, 3, 4)));

/* Only on a terminal: how it goes, `done` of `count`, at most ten times a second. */
void actor_screen_show(struct actor_screen *screen, int done, int count, const char *format, ...)
	__attribute__((format(printf, 4, 5)));
