/*
 * The gpio: trigger keeps the contract:
 *
 *     contract_gpio CHIP,ir=LINE,strobe=LINE,... [FILE...]
 *
 * on lines of this machine; each FILE reads 0 while one of them is dark (gpio-sim:
 * /sys/devices/platform/gpio-sim.0/gpiochipN/sim_gpioM/value). Without an address it says that it
 * skips.
 */
#include "drivers/gpio/trigger_gpio.h"
#include "tests/contract/trigger_contract.h"

int main(int argc, char **argv)
{
	return trigger_contract_main(argc, argv, &gpio_trigger_driver,
				     "no-such-chip,ir=NO_SUCH_LINE", "GPIO chip");
}
