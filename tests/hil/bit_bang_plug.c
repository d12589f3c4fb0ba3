/*
 * An adapter is a process: to end it is to unplug it.
 */
#include "tests/hil/bit_bang_plug.h"

#include <signal.h>
#include <stdio.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

pid_t bit_bang_plug_in(const char *build, int bus, const char *serial, const char *product,
		       const char *ppm, const char *trace)
{
	char path[256], number[12];

	snprintf(path, sizeof(path), "%s/tests/hil/bit_bang", build);
	snprintf(number, sizeof(number), "%d", bus);
	pid_t child = fork();

	if (child == 0) {
		prctl(PR_SET_PDEATHSIG, SIGKILL);
		execl(path, path, "--bus", number, "--serial", serial, "--product", product,
		      "--ppm", ppm, "--trace", trace, NULL);
		_exit(127);
	}
	return child;
}

void bit_bang_unplug(pid_t *adapter)
{
	if (*adapter <= 0)
		return;
	kill(*adapter, SIGKILL);
	waitpid(*adapter, NULL, 0);
	*adapter = 0;
}
