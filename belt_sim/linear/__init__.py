"""The belt as a linear plant for whoever designs its controller: exact with its delays, or as a state space."""
