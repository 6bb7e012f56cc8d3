"""An independent shell: CalculiX (Debian package calculix-ccx) computes what the strip law and the run-up law claim."""
