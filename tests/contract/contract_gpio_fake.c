/*
 * The gpio: trigger keeps the contract on a chip that is a file, with a guard that is a process.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "drivers/gpio/trigger_gpio.h"
#include "tests/contract/trigger_contract.h"
#include "tests/gpio/fake_gpio.h"

int main(void)
{
	char dir[] = "/tmp/stage-gpio-XXXXXX", path[64], levels[64];
	const char *const dark[] = {levels, NULL};

	if (!mkdtemp(dir))
		return 1;
	setenv(FAKE_GPIO_DIR_ENV, dir, 1);
	fake_gpio_create(dir, "gpiochip0");
	snprintf(path, sizeof(path), "%s/gpiochip0", dir);
	snprintf(levels, sizeof(levels), "%s/levels", dir);
	fake_gpio_show_levels(levels);
	const struct trigger_contract contract = {
		.driver = &gpio_trigger_driver,
		.rest = "gpiochip0,ir=IR_TRIG,strobe=STROBE,hd=HD_TRIG",
		.bad_rest = "gpiochip0,ir=NO_SUCH_LINE",
		.dark = dark,
		.plan = &trigger_contract_fast_plan,
	};
	int failed = trigger_contract_run(&contract);

	unlink(path);
	unlink(levels);
	rmdir(dir);
	return failed;
}
