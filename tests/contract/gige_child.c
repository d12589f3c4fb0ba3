/*
 * Addresses: from 127.100.0.0 on, eight for each process id and block.
 */
#include "tests/contract/gige_child.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <stdio.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>

#define ADDRESSES 8
#define BLOCKS 4

static uint32_t first_address(uint32_t block)
{
	uint32_t process = (uint32_t)getpid() & 0xffff;

	return 0x7f640000u + (process * BLOCKS + block % BLOCKS) * ADDRESSES;
}

void gige_child_address(const struct gige_child *child, uint32_t index, char address[16])
{
	struct in_addr ip;

	inet_pton(AF_INET, child->first_address, &ip);
	ip.s_addr = htonl(ntohl(ip.s_addr) + index);
	inet_ntop(AF_INET, &ip, address, 16);
}

static void become(const char *program, const char *address, const char *const *extra, int out_fd,
		   const char *log_path)
{
	const char *arguments[24] = {program,           "--cameras", "4", "--die-with-parent",
				     "--first-address", address};
	size_t count = 6;
	int log_fd = open(log_path, O_WRONLY | O_CREAT | O_TRUNC, 0600);

	for (; extra && *extra && count < 23; extra++)
		arguments[count++] = *extra;
	dup2(out_fd, STDOUT_FILENO);
	dup2(log_fd, STDERR_FILENO);
	execv(program, (char **)arguments);
	_exit(127);
}

int gige_child_start(struct gige_child *child, const char *program, uint32_t block,
		     const char *const *extra, const char *log_path)
{
	struct in_addr ip = {.s_addr = htonl(first_address(block))};
	char line[256] = "";
	int pipe_fds[2];

	inet_ntop(AF_INET, &ip, child->first_address, sizeof(child->first_address));
	if (pipe2(pipe_fds, O_CLOEXEC))
		return -1;
	child->pid = fork();
	if (child->pid == 0)
		become(program, child->first_address, extra, pipe_fds[1], log_path);
	close(pipe_fds[1]);
	ssize_t size = read(pipe_fds[0], line, sizeof(line) - 1);

	close(pipe_fds[0]);
	return child->pid > 0 && size > 0 && strncmp(line, "ready ", 6) == 0 ? 0 : -1;
}

int gige_child_end(struct gige_child *child, int signal_number)
{
	int status = -1;

	if (child->pid <= 0)
		return -1;
	kill(child->pid, signal_number);
	waitpid(child->pid, &status, 0);
	child->pid = 0;
	return status;
}
