/*
 * The child and its time.
 */
#include "calib/solve/stages.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

static void run_all(struct problem *problem)
{
	mrcal_problem_selections_t next = {.do_optimize_extrinsics = true,
					   .do_optimize_frames = true};

	problem_optimise(problem, next);
	next.do_optimize_intrinsics_core = true;
	problem_optimise(problem, next);
	next = problem_last_selections(problem);
	next.do_optimize_calobject_warp = false;
	next.do_apply_outlier_rejection = false;
	problem_optimise(problem, next);
}

static void run(struct problem *problem, enum stages stages)
{
	if (stages == STAGES_ALL)
		run_all(problem);
	if (stages == STAGES_POSES)
		problem_optimise(problem, (mrcal_problem_selections_t){.do_optimize_frames = true});
	else
		problem_optimise(problem, problem_last_selections(problem));
}

/* The alarm ends the child: its handler is the default. */
static void set_alarm(double seconds)
{
	struct itimerval timer = {
		.it_value = {(time_t)seconds, (suseconds_t)(fmod(seconds, 1) * 1e6) + 1}};
	sigset_t alarm_set;

	signal(SIGALRM, SIG_DFL);
	sigemptyset(&alarm_set);
	sigaddset(&alarm_set, SIGALRM);
	sigprocmask(SIG_UNBLOCK, &alarm_set, NULL);
	setitimer(ITIMER_REAL, &timer, NULL);
}

int stages_start(pid_t *child, struct problem *problem, enum stages stages, double seconds_max)
{
	*problem->rms_px = -1;
	pid_t pid = fork();

	if (pid < 0)
		return -errno;
	if (pid > 0) {
		*child = pid;
		return 0;
	}
	prctl(PR_SET_PDEATHSIG, SIGKILL);
	set_alarm(seconds_max);
	int null = open("/dev/null", O_WRONLY | O_CLOEXEC);
	if (null >= 0)
		dup2(null, STDERR_FILENO); /* the library talks */
	run(problem, stages);
	_exit(0);
}

int stages_wait(pid_t child, const struct problem *problem, double seconds_max, struct diag *diag)
{
	int status;

	while (waitpid(child, &status, 0) < 0)
		if (errno != EINTR)
			return -errno;
	if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) {
		diag_add(diag,
			 "the solver found no end within %g s; the views contradict each other or "
			 "the computer is busy: check the board's numbers, or allow more time",
			 seconds_max);
		return -ETIMEDOUT;
	}
	if (!WIFEXITED(status) || WEXITSTATUS(status) || !(*problem->rms_px >= 0)) {
		diag_add(diag, "the solver failed; the views contradict each other: check the "
			       "board's numbers and that every camera has its own images");
		return -EINVAL;
	}
	return 0;
}
