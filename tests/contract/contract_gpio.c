/*
 * The gpio: trigger keeps the contract:
 *
 *     contract_gpio CHIP,ir=LINE,strobe=LINE,... [FILE...]
 *
 * on lines of this machine; each FILE reads 0 while one of them is dark (gpio-sim:
 * /sys/devices/platform/gpio-sim.0/gpiochipN/sim_gpioM/value). Without an address it says that it
 * skips.
 */
#include <stdio.h>

#include "base/clock.h"
#include "drivers/gpio/trigger_gpio.h"
#include "tests/contract/trigger_contract.h"

int main(int argc, char **argv)
{
	static const struct trigger_plan plan = {.period_ns = 100 * NS_PER_MS,
						 .ir_exposure_ns = 20 * NS_PER_MS,
						 .strobe_delay_ns = 4 * NS_PER_MS,
						 .strobe_width_ns = 8 * NS_PER_MS,
						 .strobe_duty_max = 0.5,
						 .hd_divider = 4,
						 .hd_phase = 1,
						 .hd_exposure_ns = 40 * NS_PER_MS};

	if (argc < 2) {
		puts("1..0 # SKIP no GPIO lines named; ./stage hil has some");
		return 0;
	}
	const struct trigger_contract contract = {
		.driver = &gpio_trigger_driver,
		.rest = argv[1],
		.bad_rest = "no-such-chip,ir=NO_SUCH_LINE",
		.dark = (const char *const *)argv + 2,
		.plan = &plan,
	};

	return trigger_contract_run(&contract);
}
