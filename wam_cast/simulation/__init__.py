"""A cast from its start to its outcome: contact-free phase, contact phase, verdict; sequences and recordings."""
